#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"

namespace hueline::drivers {

/// RTCM 3 messages, the corrections and observations that GNSS receivers exchange: 0xD3, six zero bits, ten bits of
/// length, the content, and a CRC of 24 bits.
class RtcmForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    const auto at = [&](std::size_t i) { return static_cast<std::uint32_t>(rest[i]); };
    if (at(0) != 0xD3) return {};
    if (rest.size() < 3) return {Verdict::NeedMore, 0};
    if ((at(1) & 0xFC) != 0) return {};
    const std::size_t checked = 3 + ((at(1) & 3) << 8 | at(2));
    if (checked < 5) return {};  // without a message number
    if (rest.size() < checked + 3) return {Verdict::NeedMore, 0};
    const std::uint32_t crc = at(checked) << 16 | at(checked + 1) << 8 | at(checked + 2);
    // Two bytes are a weak sign of a message: what fails its check is noise, not a broken message.
    if (hash_.of(rest.first(checked), position) != crc) return {};
    return {Verdict::Whole, checked + 3};
  }

 private:
  OverlappingHash<Crc24Hash> hash_;
};

/// Returns the number of an RTCM 3 message that RtcmForm found whole.
inline int rtcm_number(std::span<const std::byte> message) {
  return static_cast<int>(message[3]) << 4 | static_cast<int>(message[4]) >> 4;
}

}  // namespace hueline::drivers
