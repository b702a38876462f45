#include "core/exposure_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>

#include "core/number_word.hpp"

namespace hueline {

bool ExposureChoice::has_number(std::uint32_t number) const {
  return numbers.empty() || std::any_of(numbers.begin(), numbers.end(), [&](const auto& range) {
           return range.first <= number && number <= range.second;
         });
}

std::optional<std::uint32_t> ExposureChoice::missing_number(const std::set<std::uint32_t>& exposures) const {
  for (const auto& [first, last] : numbers) {
    std::uint32_t number = first;
    for (auto at = exposures.lower_bound(first); at != exposures.end() && *at == number && number < last; ++at)
      ++number;
    if (!exposures.contains(number)) return number;
  }
  return {};
}

Status ExposureChoice::limit(double from_s, double to_s) {
  constexpr double kYear1990 = 3.15e8;
  for (const auto& [name, seconds, out] : {std::tuple("--from", from_s, &from), std::tuple("--to", to_s, &to)}) {
    if (std::isnan(seconds)) continue;
    if (seconds < kYear1990)
      return Error{ErrorCode::Invalid,
                   fmt::format("{} {} is not the GPS time of an exposure: give seconds since 1980-01-06, such as "
                               "1450000000. For seconds of the drive, take its part first (`hueline cut --from --to`)",
                               name, seconds)};
    *out = GpsTime(from_seconds(seconds));
  }
  if (from && to && *to < *from) return Error{ErrorCode::Invalid, "--to lies before --from"};
  return {};
}

Result<ExposureChoice> ExposureChoice::parse(const std::string& text) {
  ExposureChoice out;
  const Error wrong{
      ErrorCode::Invalid,
      "'" + text + "' chooses no exposures; allowed: all, every:N, or numbers and ranges such as 3,7,20-30"};
  if (text == "all") return out;
  if (constexpr std::string_view kEvery = "every:"; text.starts_with(kEvery)) {
    const auto every = parse_number<std::uint32_t>(std::string_view(text).substr(kEvery.size()));
    if (!every || *every == 0 || *every > 1'000'000) return wrong;
    out.every = static_cast<int>(*every);
    return out;
  }
  for (std::string_view left = text;;) {
    const std::size_t comma = left.find(',');
    const std::string_view part = left.substr(0, comma);
    const std::size_t dash = part.find('-');
    const auto first = parse_number<std::uint32_t>(part.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : parse_number<std::uint32_t>(part.substr(dash + 1));
    if (!first || !last || *last < *first) return wrong;
    out.numbers.emplace_back(*first, *last);
    if (comma == std::string_view::npos) return out;
    left.remove_prefix(comma + 1);
  }
}

}  // namespace hueline
