#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"

/// CoLa, the protocol of SICK's scanners, in its two forms.
///
/// CoLa-A: 0x02, printable text, 0x03. It has no check sum.
/// CoLa-B, big endian:
///
///   offset  size  field
///        0     4  0x02020202
///        4     4  length of the telegram, bytes
///        8     n  telegram
///    8 + n     1  exclusive or of the telegram's bytes
namespace hueline::drivers {

constexpr std::size_t kColaBHeaderBytes = 8, kColaBOverheadBytes = 9, kColaAOverheadBytes = 2;
/// The longest telegram that is read. A scan of today's scanners has up to 15 kB; the limit bounds how long a corrupted
/// length can hold back what follows.
constexpr std::size_t kLongestColaTelegram = 65536;

/// Exclusive or of the bytes.
struct XorHash {
  using State = std::uint8_t;
  static State next(State state, std::uint8_t byte, std::uint64_t) { return static_cast<State>(state ^ byte); }
  static std::uint8_t between(State begin, State end, std::uint64_t, std::size_t) {
    return static_cast<std::uint8_t>(begin ^ end);
  }
};

class ColaBForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    for (std::size_t i = 0; i < 4; ++i) {
      if (i == rest.size()) return {Verdict::NeedMore, 0};
      if (rest[i] != std::byte{2}) return {};
    }
    if (rest.size() < kColaBHeaderBytes) return {Verdict::NeedMore, 0};
    const std::size_t length = stream_field_big<std::uint32_t>(rest, 4);
    if (length == 0 || length > kLongestColaTelegram) return {Verdict::Broken, 0};
    if (rest.size() < length + kColaBOverheadBytes) return {Verdict::NeedMore, 0};
    const std::uint8_t sum = hash_.of(rest.subspan(kColaBHeaderBytes, length), position + kColaBHeaderBytes);
    if (rest[kColaBHeaderBytes + length] != std::byte{sum}) return {Verdict::Broken, 0};
    return {Verdict::Whole, length + kColaBOverheadBytes};
  }

 private:
  OverlappingHash<XorHash> hash_;
};

class ColaAForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    if (rest[0] != std::byte{2}) return {};
    if (rest.size() < 2) return {Verdict::NeedMore, 0};
    if (rest[1] != std::byte{'s'}) return {};
    // sRN, sAN, sSN, sFA: two capital letters follow. Without them a few random bytes would be a telegram.
    for (std::size_t i = 2; i < 4; ++i) {
      if (i == rest.size()) return {Verdict::NeedMore, 0};
      if (rest[i] < std::byte{'A'} || rest[i] > std::byte{'Z'}) return {};
    }
    std::size_t length = position == seen_at_ && seen_bytes_ > 0 ? seen_bytes_ : 2;
    while (length < rest.size() && length < kLongestColaTelegram && rest[length] >= std::byte{0x20} &&
           rest[length] < std::byte{0x7F})
      ++length;
    seen_at_ = position;
    seen_bytes_ = length;
    if (length == kLongestColaTelegram) return {Verdict::Broken, 0};
    if (length == rest.size()) return {Verdict::NeedMore, 0};
    if (rest[length] != std::byte{3}) return {Verdict::Broken, 0};
    return {Verdict::Whole, length + 1};
  }

 private:
  std::uint64_t seen_at_ = 0;
  std::size_t seen_bytes_ = 0;  // of the telegram that begins at seen_at_, found printable so far
};

}  // namespace hueline::drivers
