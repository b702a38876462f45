#pragma once

#include "drivers/stream/message_form.hpp"
#include "drivers/stream/overlapping_hash.hpp"

/// SBF, the binary format of Septentrio receivers. Little endian.
///
///   offset  size  field
///        0     2  '$' '@'
///        2     2  CRC-16/CCITT of everything behind it
///        4     2  bits 0-12 number of the block, bits 13-15 its revision
///        6     2  length of the block with its header, bytes, a multiple of 4
///        8     4  GPS time of the week, ms; 0xFFFFFFFF if unknown
///       12     2  GPS week, not modulo 1024; 0xFFFF if unknown
///       14        content
namespace hueline::drivers {

constexpr std::size_t kSbfHeaderBytes = 14;

class SbfForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool) override {
    using Verdict = Judgement::Verdict;
    if (rest[0] != std::byte{'$'}) return {};
    if (rest.size() < 2) return {Verdict::NeedMore, 0};
    if (rest[1] != std::byte{'@'}) return {};
    if (rest.size() < 8) return {Verdict::NeedMore, 0};
    const std::size_t length = stream_field<std::uint16_t>(rest, 6);
    if (length < kSbfHeaderBytes || length % 4 != 0) return {Verdict::Broken, 0};
    if (rest.size() < length) return {Verdict::NeedMore, 0};
    if (hash_.of(rest.subspan(4, length - 4), position + 4) != stream_field<std::uint16_t>(rest, 2))
      return {Verdict::Broken, 0};
    return {Verdict::Whole, length};
  }

 private:
  OverlappingHash<Crc16Hash> hash_;
};

/// What a Septentrio receiver answers to commands: lines that begin with "$R" or "$T", and prompts such as "COM1>",
/// which no line end follows.
class SbfReplyForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t, bool is_boundary) override {
    using Verdict = Judgement::Verdict;
    const auto at = [&](std::size_t i) { return static_cast<char>(rest[i]); };
    const auto is_printable = [&](std::size_t i) { return at(i) >= 0x20 && at(i) < 0x7F; };
    if (at(0) == '$') {
      if (rest.size() < 3) return {Verdict::NeedMore, 0};
      const bool is_reply = at(1) == 'R' && (at(2) == ':' || at(2) == ';' || at(2) == '?' || at(2) == '!');
      if (!is_reply && !(at(1) == 'T' && (at(2) == 'E' || at(2) == 'D'))) return {};
      std::size_t length = 3;
      while (length < rest.size() && length < kLongest && (is_printable(length) || at(length) == '\t')) ++length;
      if (length == kLongest) return {};
      if (length + 1 >= rest.size()) return {Verdict::NeedMore, 0};
      if (at(length) == '\r' && at(length + 1) == '\n') return {Verdict::Whole, length + 2};
      return {};
    }
    // A prompt: letters, a number, '>'.
    if (!is_boundary || at(0) < 'A' || at(0) > 'Z') return {};
    std::size_t length = 1;
    while (length < rest.size() && length < 6 && at(length) >= 'A' && at(length) <= 'Z') ++length;
    while (length < rest.size() && length < 8 && at(length) >= '0' && at(length) <= '9') ++length;
    if (length == rest.size()) return {Verdict::NeedMore, 0};
    return at(length) == '>' ? Judgement{Verdict::Whole, length + 1} : Judgement{};
  }

 private:
  static constexpr std::size_t kLongest = 1024;
};

}  // namespace hueline::drivers
