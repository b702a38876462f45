#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"

/// Groups and messages of an Applanix POS (LV, AV, MV). Little endian.
///
///   offset  size  field
///        0     4  "$GRP", or "$MSG" for an answer to a message
///        4     2  number of the group or message
///        6     2  bytes behind this field
///        8     8  group: time 1, s           message: its own content
///       16     8  group: time 2, s
///       24     8  group: distance, m
///       32     1  group: scale of time 1 (bits 0-3) and time 2 (4-7): 0 POS (since power-up), 1 GPS, 2 UTC, 3 user's;
///                 GPS and UTC are times of the week
///       33     1  group: kind of distance
///       34        group: content
///   the last   4  check sum: all 16-bit words together give 0; then "$#"
namespace hueline::drivers {

constexpr std::size_t kGroupHeaderBytes = 34, kGroupFooterBytes = 4;

class ApplanixForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    constexpr char kGroup[] = "$GRP", kMessage[] = "$MSG";
    bool is_group = true, is_message = true;
    for (std::size_t i = 0; i < 4; ++i) {
      if (i == rest.size()) return {Verdict::NeedMore, 0};
      is_group = is_group && rest[i] == static_cast<std::byte>(kGroup[i]);
      is_message = is_message && rest[i] == static_cast<std::byte>(kMessage[i]);
      if (!is_group && !is_message) return {};
    }
    if (rest.size() < 8) return {Verdict::NeedMore, 0};
    const std::size_t length = std::size_t{8} + stream_field<std::uint16_t>(rest, 6);
    if (length % 4 != 0 || length < (is_group ? kGroupHeaderBytes : 8) + kGroupFooterBytes) return {Verdict::Broken, 0};
    if (rest.size() < length) return {Verdict::NeedMore, 0};
    if (rest[length - 2] != std::byte{'$'} || rest[length - 1] != std::byte{'#'} ||
        hash_.of(rest.first(length), position) != 0)
      return {Verdict::Broken, 0};
    return {Verdict::Whole, length};
  }

 private:
  OverlappingHash<WordSumHash> hash_;
};

}  // namespace hueline::drivers
