#include "drivers/usb3_vision/gencp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <concepts>
#include <string>
#include <utility>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint32_t kMagic = 0x43563355;  // "U3VC"
constexpr std::uint16_t kWantsAnswer = 0x4000;
constexpr std::uint16_t kRead = 0x0800, kWrite = 0x0802, kPending = 0x0805;
constexpr std::size_t kHead = 12, kAddress = 8, kPendingBody = 4;
constexpr std::size_t kSmallestMessage = 64, kUsbPacket = 1024;
constexpr int kMostAttempts = 3, kMostPending = 100, kMostLate = 16;

template <std::unsigned_integral T>
void append(std::vector<std::byte>& to, T value) {
  to.resize(to.size() + sizeof(T));
  put_little(to, to.size() - sizeof(T), value);
}

struct Refusal {
  std::uint32_t status;
  ErrorCode code;
  const char* text;
};
// GenCP 1.3, table of status codes.
constexpr Refusal kRefusals[] = {
    {0x8001, ErrorCode::Unsupported, "it does not know the command"},
    {0x8002, ErrorCode::Invalid, "the value is not allowed"},
    {0x8003, ErrorCode::Invalid, "it has no such address"},
    {0x8004, ErrorCode::Invalid, "the register cannot be written"},
    {0x8005, ErrorCode::Invalid, "the address is not aligned"},
    {0x8006, ErrorCode::Unavailable, "the register cannot be used now"},
    {0x8007, ErrorCode::Unavailable, "it is busy"},
    {0x800B, ErrorCode::Unavailable, "the command came too late"},
    {0x800E, ErrorCode::Malformed, "the head of the command is wrong"},
    {0x800F, ErrorCode::Unavailable, "its configuration does not allow it"},
};

Error refused(std::uint32_t status, const std::string& what) {
  const auto* found = std::ranges::find(kRefusals, status, &Refusal::status);
  if (found != std::end(kRefusals))
    return {found->code,
            fmt::format("the camera refused to {}: {} (GenCP status 0x{:04x})", what, found->text, status)};
  return {ErrorCode::Unavailable, fmt::format("the camera refused to {} (GenCP status 0x{:04x})", what, status)};
}

std::string what_of(std::uint16_t command, std::uint64_t address) {
  return fmt::format("{} its memory at 0x{:x}", command == kRead ? "read" : "write", address);
}

}  // namespace

void GencpClient::set_limits(const Limits& limits) {
  limits_ = limits;
  limits_.command_bytes = std::max(limits_.command_bytes, kSmallestMessage);
  limits_.answer_bytes = std::max(limits_.answer_bytes, kSmallestMessage);
}

Status GencpClient::read(std::uint64_t address, std::span<std::byte> out) {
  constexpr std::size_t kMostRead = 0xFFFF;
  const std::size_t most = std::min(limits_.answer_bytes - kHead, kMostRead);
  while (!out.empty()) {
    const auto piece = static_cast<std::uint16_t>(std::min(most, out.size()));
    Bytes body;
    append(body, address);
    append(body, std::uint16_t{0});
    append(body, piece);
    const auto answer = ask(kRead, body, address);
    if (!answer) return answer.error();
    if (answer->size() != piece)
      return Error{ErrorCode::Malformed,
                   fmt::format("the camera gave {} of {} bytes at 0x{:x}", answer->size(), piece, address)};
    std::ranges::copy(*answer, out.begin());
    out = out.subspan(piece);
    address += piece;
  }
  return {};
}

Status GencpClient::write(std::uint64_t address, std::span<const std::byte> bytes) {
  const std::size_t most = limits_.command_bytes - kHead - kAddress;
  while (!bytes.empty()) {
    const auto piece = bytes.first(std::min(most, bytes.size()));
    Bytes body;
    append(body, address);
    body.insert(body.end(), piece.begin(), piece.end());
    if (const auto answer = ask(kWrite, body, address); !answer) return answer.error();
    bytes = bytes.subspan(piece.size());
    address += piece.size();
  }
  return {};
}

Result<GencpClient::Bytes> GencpClient::ask(std::uint16_t command, const Bytes& body, std::uint64_t address) {
  ++number_;
  Bytes message;
  append(message, kMagic);
  append(message, kWantsAnswer);
  append(message, command);
  append(message, static_cast<std::uint16_t>(body.size()));
  append(message, number_);
  message.insert(message.end(), body.begin(), body.end());
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    if (const Status sent = channel_.send(message); !sent) {
      if (sent.error().code == ErrorCode::TimedOut) continue;
      return sent.error();
    }
    auto answer = wait_for_answer(command, address);
    if (answer || answer.error().code != ErrorCode::TimedOut) return answer;
  }
  return Error{ErrorCode::TimedOut, fmt::format("the camera does not answer: {} tries to {}, {} ms each", kMostAttempts,
                                                what_of(command, address), limits_.answers_within.count())};
}

Result<GencpClient::Bytes> GencpClient::wait_for_answer(std::uint16_t command, std::uint64_t address) {
  std::chrono::milliseconds limit = limits_.answers_within;
  int pending = 0, late = 0;
  while (true) {
    // Whole packets of USB: a packet for which there is no room is an error of the bus.
    Bytes answer((limits_.answer_bytes + kUsbPacket - 1) / kUsbPacket * kUsbPacket);
    const auto size = channel_.receive(answer, limit);
    if (!size) return size.error();
    answer.resize(std::min(*size, answer.size()));
    if (answer.size() < kHead || get_little<std::uint32_t>(answer, 0) != kMagic ||
        get_little<std::uint16_t>(answer, 10) != number_) {
      if (++late > kMostLate) return Error{ErrorCode::Malformed, "the camera sends what is no answer, again and again"};
      continue;
    }
    const std::uint32_t status = get_little<std::uint16_t>(answer, 4), kind = get_little<std::uint16_t>(answer, 6),
                        bytes = get_little<std::uint16_t>(answer, 8);
    if (kind == kPending && answer.size() >= kHead + kPendingBody) {
      if (++pending > kMostPending)
        return Error{ErrorCode::Unavailable,
                     fmt::format("the camera asks for more time again and again to {}", what_of(command, address))};
      limit = std::max(limits_.answers_within, std::chrono::milliseconds(get_little<std::uint16_t>(answer, kHead + 2)));
      continue;
    }
    if (status != 0) return refused(status, what_of(command, address));
    if (kind != command + 1U || bytes > answer.size() - kHead)
      return Error{ErrorCode::Malformed,
                   fmt::format("the camera's answer to {} has the kind 0x{:04x} and {} of {} bytes",
                               what_of(command, address), kind, answer.size() - kHead, bytes)};
    return Bytes(answer.begin() + kHead, answer.begin() + static_cast<std::ptrdiff_t>(kHead + bytes));
  }
}

}  // namespace hueline::drivers
