#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"

/// UBX, the binary protocol of u-blox receivers. Little endian.
///
///   offset  size  field
///        0     2  0xB5 0x62
///        2     1  class
///        3     1  id
///        4     2  length of the payload, bytes
///        6     n  payload
///    6 + n     2  Fletcher's check sum of class to payload
namespace hueline::drivers {

constexpr std::size_t kUbxHeaderBytes = 6, kUbxOverheadBytes = 8;

class UbxForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    if (rest[0] != std::byte{0xB5}) return {};
    if (rest.size() < 2) return {Verdict::NeedMore, 0};
    if (rest[1] != std::byte{0x62}) return {};
    if (rest.size() < kUbxHeaderBytes) return {Verdict::NeedMore, 0};
    const std::size_t payload = stream_field<std::uint16_t>(rest, 4);
    if (payload > kLongestPayload) return {Verdict::Broken, 0};
    if (rest.size() < payload + kUbxOverheadBytes) return {Verdict::NeedMore, 0};
    const std::uint16_t sum = hash_.of(rest.subspan(2, payload + 4), position + 2);
    if (sum != stream_field<std::uint16_t>(rest, payload + kUbxHeaderBytes)) return {Verdict::Broken, 0};
    return {Verdict::Whole, payload + kUbxOverheadBytes};
  }

 private:
  /// The longest messages of today's receivers have some 4000 bytes. The limit bounds how long a corrupted length can
  /// hold back what follows.
  static constexpr std::size_t kLongestPayload = 16384;
  OverlappingHash<FletcherHash> hash_;
};

}  // namespace hueline::drivers
