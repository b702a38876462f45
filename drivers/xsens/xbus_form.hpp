#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"

/// Xbus messages, the protocol of Xsens MTi devices. Big endian.
///
///   offset  size  field
///        0     1  0xFA
///        1     1  bus identifier, 0xFF for a single device
///        2     1  number of the message
///        3     1  length of the data; 255: it is in the next two bytes
///   4 or 6     n  data
///  the last    1  all bytes behind the first one together give 0 modulo 256
namespace hueline::drivers {

class XbusForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    if (rest[0] != std::byte{0xFA}) return {};
    if (rest.size() < 2) return {Verdict::NeedMore, 0};
    if (rest[1] != std::byte{0xFF}) return {};
    if (rest.size() < 4) return {Verdict::NeedMore, 0};
    std::size_t header = 4, data = static_cast<std::size_t>(rest[3]);
    if (data == 255) {
      if (rest.size() < 6) return {Verdict::NeedMore, 0};
      header = 6;
      data = stream_field_big<std::uint16_t>(rest, 4);
      if (data > kLongest) return {Verdict::Broken, 0};
    }
    const std::size_t length = header + data + 1;
    if (rest.size() < length) return {Verdict::NeedMore, 0};
    if (hash_.of(rest.subspan(1, length - 1), position + 1) != 0) return {Verdict::Broken, 0};
    return {Verdict::Whole, length};
  }

 private:
  static constexpr std::size_t kLongest = 8192;
  OverlappingHash<SumHash> hash_;
};

}  // namespace hueline::drivers
