#include "drivers/transport/can_log_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "core/packed_file.hpp"

namespace hueline::drivers {
namespace {

/// Longest line that is read. A CAN FD frame of 64 bytes takes some 300 characters. A file without line ends is no log,
/// whatever its size.
constexpr std::size_t kLongestLogLine = 4096;

enum class Line : std::uint8_t { Read, TooLong, None };

/// Reads the next line, without its end. Of a line that is too long it keeps only the beginning and skips the rest.
Line read_line(std::istream& in, std::string& line) {
  line.clear();
  bool is_whole = true;
  for (int c = in.get(); c != std::istream::traits_type::eof(); c = in.get()) {
    if (c == '\n') return is_whole ? Line::Read : Line::TooLong;
    if (line.size() < kLongestLogLine)
      line += static_cast<char>(c);
    else
      is_whole = false;
  }
  return line.empty() ? Line::None : is_whole ? Line::Read : Line::TooLong;
}

}  // namespace

void CanLogSource::Config::visit(Keys& keys) {
  keys.text(
      required(
          "file", "",
          "A log of the bus: Vector's ASC or BLF, PEAK's TRC, what candump writes with `-L` or `-t a`, a table (CSV) "
          "of SavvyCAN or python-can, a log of BUSMASTER, or a capture file of Wireshark or tcpdump (`tcpdump -i "
          "can0`)."),
      path);
  keys.whole({"channel", "", "The channel that is read from a log that has several by number.", "0: all"}, channel,
             {0, 255});
  static const TextForm name{"1 to 15 characters",
                             [](const std::string& text) { return !text.empty() && text.size() <= 15; }};
  keys.text(
      {"interface", "", "The interface that is read from a log of candump or a capture file, such as can0.", "all"},
      interface, name);
}

KeyError CanLogSource::Config::validate() const {
  if (path.empty()) return not_allowed("file", "empty", "a log of a CAN bus");
  return check_keys(*this);
}

Status CanLogSource::open() {
  close();
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  auto input = InputFile::open(config_.path);
  if (!input.ok()) return input.error();
  parser_ = {};
  waiting_.reset();
  line_ = malformed_ = 0;
  first_malformed_.clear();
  first_bad_line_.clear();
  interface_.clear();
  first_interface_.clear();
  are_several_told_ = false;
  last_ = {};
  std::array<std::byte, 24> head{};
  const auto length = static_cast<std::size_t>(std::min<std::uint64_t>(head.size(), input->size()));
  if (Status read = input->read(0, std::span(head).first(length)); !read.ok()) return read;
  const std::string_view first(reinterpret_cast<const char*>(head.data()), length);
  if (is_blf(first)) {
    blf_.emplace(std::move(*input));
    return {};
  }
  if (is_capture(first)) {
    auto capture = CaptureFile::open(config_.path);
    if (!capture.ok()) return capture.error();
    capture_.emplace(std::move(*capture), config_.path);
    return {};
  }
  if (const std::string packed = how_to_unpack(first); !packed.empty())
    return Error{ErrorCode::Unsupported, config_.path + " " + packed};
  if (Status here = input->check_on_this_computer(); !here.ok()) return here;
  input_ = std::move(*input);
  file_.emplace(config_.path, std::ios::binary);
  if (!*file_) {
    const int why = errno;
    file_.reset();
    return io_error("open " + config_.path, why);
  }
  return {};
}

/// Returns the next frame of a text, or nothing at its end.
Result<std::optional<CanLogEntry>> CanLogSource::next_line() {
  std::string line;
  for (Line kind = read_line(*file_, line); kind != Line::None; kind = read_line(*file_, line)) {
    ++line_;
    Result<std::optional<CanLogEntry>> entry =
        kind == Line::TooLong
            ? Error{ErrorCode::Malformed, fmt::format("a line of more than {} characters", kLongestLogLine)}
            : parser_.take(line);
    if (!entry.ok()) {
      const std::string wrong = fmt::format("line {}: {}", line_, entry.error().message);
      if (first_bad_line_.empty()) first_bad_line_ = wrong;
      return Error{ErrorCode::Malformed, wrong};
    }
    if (*entry) return entry;
  }
  if (file_->bad()) return io_error("read " + config_.path, errno);
  return std::optional<CanLogEntry>();
}

/// Returns the next frame of the file, whatever it is. Errors say which file.
Result<std::optional<CanLogEntry>> CanLogSource::next_entry() {
  if (capture_) return capture_->next();
  auto entry = blf_ ? blf_->next() : next_line();
  if (entry.ok() || (entry.error().code != ErrorCode::Malformed && entry.error().code != ErrorCode::Truncated))
    return entry;
  return Error{entry.error().code, config_.path + ": " + entry.error().message};
}

Result<Packet> CanLogSource::next(std::stop_token stop) {
  if (!file_ && !blf_ && !capture_) return Error{ErrorCode::Disconnected, config_.path + " is not open"};
  if (waiting_) return *std::exchange(waiting_, std::nullopt);
  for (;;) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    const Result<std::optional<CanLogEntry>> entry = next_entry();
    if (!entry.ok()) {
      if (entry.error().code != ErrorCode::Malformed && entry.error().code != ErrorCode::Truncated)
        return entry.error();
      if (malformed_++ == 0) first_malformed_ = entry.error().message;
      continue;
    }
    if (!*entry) break;
    if (config_.channel != 0 && (*entry)->frame.bus != config_.channel) continue;
    if (!config_.interface.empty() && (*entry)->interface != config_.interface) continue;
    last_ = HostTime((*entry)->time);
    interface_ = (*entry)->interface;
    Packet packet;
    packet.received = last_;
    packet.bytes = Buffer::copy_of(encode_can_packet((*entry)->frame));
    if (first_interface_.empty()) first_interface_ = interface_;
    if (interface_ != first_interface_ && !std::exchange(are_several_told_, true)) {
      waiting_ = std::move(packet);
      return fault_packet(last_, FaultKind::WrongDevice, 1,
                          fmt::format("{}: frames of {} and of {} are taken for one bus's: the key interface names one",
                                      config_.path, first_interface_, interface_));
    }
    return packet;
  }
  if (const std::uint64_t count = std::exchange(malformed_, 0); count > 0)
    return fault_packet(last_, FaultKind::Malformed, count, first_malformed_);
  return Error{ErrorCode::EndOfData, config_.path + ": end of log"};
}

}  // namespace hueline::drivers
