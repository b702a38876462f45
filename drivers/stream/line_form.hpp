#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/nmea_form.hpp"

namespace hueline::drivers {

/// A line of plain text between messages: what a receiver answers to a command, and the comments that people put at the
/// head of a log. It is recognised at a boundary only, must end with a line feed within 1024 bytes, and does not begin
/// with '$' or '!', which begin NMEA sentences. It also ends where a whole sentence begins with '$': programs that log
/// a receiver put the time, or a quotation mark, before each sentence. A sentence that a comment quotes, behind '#', is
/// text.
class LineForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool is_boundary) override;

 private:
  std::uint64_t seen_at_ = 0;   // the line that was looked at last begins here,
  std::size_t seen_bytes_ = 0;  // and so many of its bytes are text
  NmeaForm sentence_;
};

}  // namespace hueline::drivers
