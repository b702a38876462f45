#include "drivers/stream/nmea_form.hpp"

#include <cmath>
#include <cstdint>

#include "core/number_word.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kLongestSentence = 1024;

constexpr int hex_digit(std::byte byte) {
  const auto c = static_cast<unsigned char>(byte);
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

}  // namespace

Judgement NmeaForm::judge(std::span<const std::byte> rest, std::uint64_t position, bool) {
  using Verdict = Judgement::Verdict;
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(rest[i]); };
  if (at(0) != '$' && at(0) != '!') return {};
  if (rest.size() < 2) return {Verdict::NeedMore, 0};
  if (at(1) < 'A' || at(1) > 'Z') return {};
  std::size_t length = position == seen_at_ && seen_bytes_ > 0 ? seen_bytes_ : 1;
  // The text has no control characters, and no '$', which begins the next sentence when the end of this one is lost.
  while (length < rest.size() && length < kLongestSentence && at(length) >= 0x20 && at(length) < 0x7F &&
         at(length) != '$' && at(length) != '*')
    ++length;
  seen_at_ = position;
  seen_bytes_ = length;
  if (length == rest.size() && length < kLongestSentence) return {Verdict::NeedMore, 0};
  if (length == kLongestSentence || at(length) != '*') return {Verdict::Broken, 0};
  if (rest.size() < length + 4) return {Verdict::NeedMore, 0};
  const int high = hex_digit(rest[length + 1]), low = hex_digit(rest[length + 2]);
  std::uint8_t sum = 0;
  for (std::size_t i = 1; i < length; ++i) sum = static_cast<std::uint8_t>(sum ^ at(i));
  if (high < 0 || low < 0 || sum != high * 16 + low) return {Verdict::Broken, 0};
  if (at(length + 3) == '\n') return {Verdict::Whole, length + 4};
  if (at(length + 3) != '\r') return {Verdict::Whole, length + 3};
  if (rest.size() < length + 5) return {Verdict::NeedMore, 0};
  return {Verdict::Whole, length + (at(length + 4) == '\n' ? 5u : 4u)};
}

NmeaSentence::NmeaSentence(std::span<const std::byte> bytes) {
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  rest.remove_prefix(rest.empty() ? 0 : 1);
  rest = rest.substr(0, rest.rfind('*'));
  while (count_ < kMost) {
    const std::size_t comma = rest.find(',');
    fields_[count_++] = rest.substr(0, comma);
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
}

std::string_view NmeaSentence::talker() const {
  return fields_[0].starts_with('P') || fields_[0].size() < 5 ? std::string_view() : fields_[0].substr(0, 2);
}
std::string_view NmeaSentence::type() const { return talker().empty() ? fields_[0] : fields_[0].substr(2); }
std::string_view NmeaSentence::field(std::size_t number) const {
  return number < count_ ? fields_[number] : std::string_view();
}
std::optional<double> NmeaSentence::number(std::size_t number) const {
  std::string_view text = field(number);
  if (text.starts_with('+')) text.remove_prefix(1);
  const std::optional<double> value = parse_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}
std::optional<int> NmeaSentence::whole(std::size_t number) const { return parse_number<int>(field(number)); }

}  // namespace hueline::drivers
