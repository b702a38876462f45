#include "drivers/transport/can_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>

#include "drivers/big_endian.hpp"

namespace hueline::drivers {
namespace {

/// A frame as the kernel's sockets have it: id with flags, length, flags of CAN FD, two bytes, data.
struct KernelFrame {
  std::span<const std::byte> bytes;
  bool is_big_endian = true;  // the id
  bool is_fd = false;         // as the protocol says; else the flags do
  bool is_local = false;
};

/// Returns the frame of a CAN bus in a frame of the capture; nothing if it is one of another network. `interface` is
/// set where the frame itself names it.
std::optional<KernelFrame> kernel_frame(const CaptureFrame& frame, std::string& interface) {
  constexpr std::uint32_t kCanLink = 227, kCooked = 113, kCooked2 = 276;
  constexpr unsigned kClassic = 0x0C, kFd = 0x0D, kXl = 0x0E, kOutgoing = 4;
  const auto bytes = frame.bytes;
  if (frame.link_type == kCanLink) return KernelFrame{bytes, true, false, false};
  const bool is_second = frame.link_type == kCooked2;
  const std::size_t head = is_second ? 20 : 16;
  if ((!is_second && frame.link_type != kCooked) || bytes.size() < head) return {};
  const unsigned protocol = be16(bytes.data() + (is_second ? 0 : 14));
  if (protocol != kClassic && protocol != kFd && protocol != kXl) return {};
  if (is_second) interface = std::to_string(be32(bytes.data() + 4));
  const unsigned type = is_second ? static_cast<unsigned>(bytes[10]) : be16(bytes.data());
  return KernelFrame{bytes.subspan(head), frame.is_big_endian, protocol == kFd, type == kOutgoing};
}

/// Returns what is wrong; nothing if `out` is the frame.
std::string_view take_frame(const KernelFrame& in, CanFrame& out) {
  constexpr std::size_t kHead = 8;
  constexpr unsigned kXlFlag = 0x80, kFdFlag = 0x04;
  if (in.bytes.size() < kHead) return "a frame of a CAN bus without its head";
  std::uint32_t id = be32(in.bytes.data());
  if (!in.is_big_endian) id = __builtin_bswap32(id);
  const auto length = static_cast<unsigned>(in.bytes[4]), flags = static_cast<unsigned>(in.bytes[5]);
  if ((length & kXlFlag) != 0) return "a frame of CAN XL, which is not read";
  out.is_error = (id & 0x20000000) != 0;
  out.is_extended = !out.is_error && (id & 0x80000000) != 0;
  out.is_remote = !out.is_error && (id & 0x40000000) != 0;
  out.id = id & (out.is_extended || out.is_error ? 0x1FFFFFFF : 0x7FF);
  // Not every kernel sets the flag, but only frames of CAN FD are longer than 8 bytes.
  out.is_fd = in.is_fd || (flags & kFdFlag) != 0 || length > 8;
  out.is_local = in.is_local;
  if (out.is_remote) return {};
  if (length > kCanDataMost || in.bytes.size() < kHead + length) return "a frame of a CAN bus without its data";
  out.length = static_cast<std::uint8_t>(length);
  std::memcpy(out.data.data(), in.bytes.data() + kHead, length);
  return {};
}

}  // namespace

Result<std::optional<CanLogEntry>> CanCapture::next() {
  while (!is_ended_) {
    const Result<CaptureFrame> frame = file_.next();
    if (!frame.ok()) {
      is_ended_ = true;
      if (frame.error().code == ErrorCode::EndOfData) break;
      return frame.error();
    }
    CanLogEntry out;
    out.interface = frame->interface;
    const auto found = kernel_frame(*frame, out.interface);
    if (!found) continue;
    out.time = frame->time;
    if (const auto wrong = take_frame(*found, out.frame); !wrong.empty())
      return Error{ErrorCode::Malformed, fmt::format("{}: {} at byte {}", name_, wrong, frame->offset)};
    return std::optional(std::move(out));
  }
  return std::optional<CanLogEntry>();
}

bool is_can_capture(const std::string& path) {
  auto file = CaptureFile::open(path);
  if (!file.ok()) return false;
  const Result<CaptureFrame> first = file->next();
  std::string interface;
  return first.ok() && kernel_frame(*first, interface).has_value();
}

}  // namespace hueline::drivers
