#include "drivers/novatel/framer.hpp"

#include <algorithm>
#include <utility>

#include "drivers/novatel/message_table.hpp"

namespace hueline::drivers {
namespace {

// Long runs of garbage (a wrong baud rate, for example) are reported in pieces of this size, so that they are reported
// soon.
constexpr std::uint64_t kReportSkippedBytes = 4096;
constexpr std::size_t kLongestLine = 1024;

constexpr bool is_text(std::byte byte) {
  const auto c = static_cast<unsigned char>(byte);
  return (c >= 0x20 && c < 0x7F) || c == '\r' || c == '\n' || c == '\t';
}
/// Returns whether `byte` begins a line of the receiver's text: abbreviated ASCII, a prompt, an ASCII log of either
/// kind, or NMEA.
constexpr bool opens_line(std::byte byte) {
  const auto c = static_cast<unsigned char>(byte);
  return c == '<' || c == '[' || c == '#' || c == '%' || c == '$';
}

}  // namespace

std::string NovatelFramer::Config::validate() const {
  if (max_message_bytes < 1024 || max_message_bytes > 65599) return "max_message_bytes must be 1024 .. 65599";
  return {};
}

void NovatelFramer::feed(std::span<const std::byte> bytes, HostTime received, Sink& sink) {
  bytes_.feed(bytes, received, [&](std::span<const std::byte> data) { return scan(data, false, sink); });
}

void NovatelFramer::flush(Sink& sink) {
  bytes_.flush([&](std::span<const std::byte> data) { return scan(data, true, sink); });
  report_skipped(sink);
  place_ = Place::Boundary;
}

void NovatelFramer::discard(Sink& sink) {
  skipped_ += bytes_.discard();
  text_seen_ = 0;
  report_skipped(sink);
  place_ = Place::Boundary;
}

std::size_t NovatelFramer::scan(std::span<const std::byte> data, bool is_final, Sink& sink) {
  std::size_t at = 0;
  while (at < data.size()) {
    const std::span<const std::byte> rest = data.subspan(at);
    if (rest[0] == kSync1) {
      NovatelMessage message;
      Verdict verdict = judge(rest, message);
      if (verdict == Verdict::NeedMore && !is_final) return at;
      if (verdict == Verdict::NeedMore) verdict = rest.size() >= 3 ? Verdict::Broken : Verdict::Noise;
      if (verdict == Verdict::Message) {
        report_skipped(sink);
        at += message.wire_bytes;
        bytes_.decided(message.wire_bytes);
        message.received = bytes_.received_of_last();
        sink.on_message(message);
        place_ = Place::Boundary;
        continue;
      }
      if (verdict == Verdict::Broken && broken_++ == 0) first_broken_id_ = message.header.id;
    } else if (may_start_text(rest[0])) {
      const std::size_t most = std::min(rest.size(), kLongestLine);
      std::size_t length = std::exchange(text_seen_, 0);
      while (length < most && is_text(rest[length]) && rest[length] != std::byte{'\n'}) ++length;
      const bool has_line_end = length < most && rest[length] == std::byte{'\n'};
      if (length == rest.size() && length < kLongestLine && !is_final) {
        text_seen_ = length;
        return at;
      }
      if (has_line_end) ++length;
      report_skipped(sink);
      at += length;
      bytes_.decided(length);
      sink.on_text({reinterpret_cast<const char*>(rest.data()), length}, bytes_.received_of_last());
      place_ = Place::Text;
      continue;
    }
    skip(rest[0], sink);
    ++at;
  }
  return at;
}

NovatelFramer::Verdict NovatelFramer::judge(std::span<const std::byte> data, NovatelMessage& message) {
  if (data.size() < 2) return Verdict::NeedMore;
  if (data[1] != kSync2) return Verdict::Noise;
  if (data.size() < 3) return Verdict::NeedMore;
  NovatelHeader& header = message.header;
  std::size_t header_bytes = kShortHeaderBytes, body_bytes = 0;
  if (data[2] == kSyncLong) {
    if (data.size() < 10) return Verdict::NeedMore;
    header.id = field<std::uint16_t>(data, 4);
    header_bytes = field<std::uint8_t>(data, 3);
    body_bytes = field<std::uint16_t>(data, 8);
    if (header_bytes < kLongHeaderBytes || header_bytes > kLongestHeaderBytes) return Verdict::Broken;
  } else if (data[2] == kSyncShort) {
    if (data.size() < 6) return Verdict::NeedMore;
    header.is_short = true;
    header.id = field<std::uint16_t>(data, 4);
    body_bytes = field<std::uint8_t>(data, 3);
  } else {
    return Verdict::Noise;
  }
  message.wire_bytes = header_bytes + body_bytes + kCrcBytes;
  // An answer to a command carries text under the command's id, so it may have any length.
  const bool is_response = !header.is_short && (field<std::uint8_t>(data, 6) & 0x80) != 0;
  if (message.wire_bytes > config_.max_message_bytes || (!is_response && !is_plausible_length(header.id, body_bytes)))
    return Verdict::Broken;
  if (data.size() < message.wire_bytes) return Verdict::NeedMore;
  const std::size_t checked = header_bytes + body_bytes;
  if (checksums_.of(data.first(checked), bytes_.position()) != field<std::uint32_t>(data, checked))
    return Verdict::Broken;

  if (header.is_short) {
    header.week = field<std::uint16_t>(data, 6);
    header.milliseconds = field<std::uint32_t>(data, 8);
  } else {
    header.is_response = is_response;
    // OEM7 has antennas 0 and 1. Older receivers have one antenna, and put other numbers into these bits, which were
    // reserved.
    header.antenna = (field<std::uint8_t>(data, 6) & 0x1F) == 1 ? 1 : 0;
    header.time_status = field<std::uint8_t>(data, 13);
    header.week = field<std::uint16_t>(data, 14);
    header.milliseconds = field<std::uint32_t>(data, 16);
  }
  message.body = data.subspan(header_bytes, body_bytes);
  return Verdict::Message;
}

bool NovatelFramer::may_start_text(std::byte byte) const {
  switch (place_) {
    case Place::Boundary:
      return opens_line(byte) || byte == std::byte{'\r'} || byte == std::byte{'\n'};
    case Place::Text:
      return is_text(byte);
    case Place::Lost:
      return opens_line(byte) && last_but_one_ == std::byte{'\r'} && last_ == std::byte{'\n'};
  }
  return false;
}

void NovatelFramer::skip(std::byte byte, Sink& sink) {
  if (place_ != Place::Lost) last_ = std::byte{};
  place_ = Place::Lost;
  last_but_one_ = last_;
  last_ = byte;
  bytes_.decided(1);
  if (++skipped_ == kReportSkippedBytes) report_skipped(sink);
}

void NovatelFramer::report_skipped(Sink& sink) {
  if (skipped_ == 0) return;
  sink.on_skipped(skipped_, broken_, first_broken_id_, bytes_.received_of_last());
  skipped_ = broken_ = 0;
}

}  // namespace hueline::drivers
