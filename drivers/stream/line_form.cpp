#include "drivers/stream/line_form.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kLongestLine = 1024;

constexpr bool is_text(std::byte byte) {
  const auto c = static_cast<unsigned char>(byte);
  return (c >= 0x20 && c < 0x7F) || c == '\r' || c == '\t';
}

}  // namespace

Judgement LineForm::judge(std::span<const std::byte> rest, std::uint64_t position, bool is_boundary) {
  using Verdict = Judgement::Verdict;
  if (!is_boundary || rest[0] == std::byte{'$'} || rest[0] == std::byte{'!'}) return {};
  const bool is_comment = rest[0] == std::byte{'#'};
  std::size_t length = position == seen_at_ ? seen_bytes_ : 0;
  seen_at_ = position;
  for (; length < rest.size() && length < kLongestLine && is_text(rest[length]); ++length) {
    if (is_comment || rest[length] != std::byte{'$'}) continue;
    seen_bytes_ = length;
    const auto verdict = sentence_.judge(rest.subspan(length), position + length, true).verdict;
    if (verdict == Verdict::NeedMore) return {verdict, 0};
    if (verdict == Verdict::Whole) return {verdict, length};
  }
  seen_bytes_ = length;
  if (length == kLongestLine) return {};
  if (length == rest.size()) return {Verdict::NeedMore, 0};
  if (rest[length] != std::byte{'\n'}) return {};
  return {Verdict::Whole, length + 1};
}

}  // namespace hueline::drivers
