#include "sync/clock_relation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/portable_math.hpp"

namespace hueline::sync {
namespace {

constexpr double kSigmaOfDeviation = 1.4826;  // sigma of a normal distribution per median absolute deviation

// Times beyond these are no times of a computer, but damage. Within them no sum or difference below overflows.
constexpr nanoseconds kFarthestPair{std::int64_t{1} << 60}, kFarthest{std::int64_t{1} << 61};

/// The difference of the clocks at a second that both saw. Numbers in ns are relative to those of the first pair, so
/// that they are exact.
struct Pair {
  double at = 0, difference = 0;
  double sigma = 0;
  std::int64_t second = 0;
  bool is_used = false;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

/// Returns the slope of all pairs together, from pairs that lie half of the whole time apart: less than a quarter of
/// them may be wrong.
double common_rate(const std::vector<Pair>& pairs) {
  const std::size_t half = pairs.size() / 2;
  std::vector<double> slopes;
  for (std::size_t i = 0; i + half < pairs.size(); ++i)
    slopes.push_back((pairs[i + half].difference - pairs[i].difference) / (pairs[i + half].at - pairs[i].at));
  return median(std::move(slopes));
}

struct Line {
  double offset = 0, rate = 0, sigma = 0, rate_sigma = 0;  // at the knot; ns, and ns per ns
  std::size_t used = 0, left_out = 0;
};

/// Fits a line to the pairs in [begin, end), whose slope is about `rate`.
Line fit_line(std::vector<Pair>& pairs, std::size_t begin, std::size_t end, double at, double rate,
              const ClockRelation::Config& config) {
  std::vector<double> rests, sigmas;
  for (std::size_t i = begin; i < end; ++i) {
    rests.push_back(pairs[i].difference - rate * (pairs[i].at - at));
    sigmas.push_back(pairs[i].sigma);
  }
  const double middle = median(rests), sigma = median(sigmas);
  std::vector<double> deviations;
  for (const double rest : rests) deviations.push_back(std::abs(rest - middle));
  const double most = std::max(6 * kSigmaOfDeviation * median(deviations),
                               5 * sigma + 1e9 * static_cast<double>(config.around.count()) * config.wander);
  Line out;
  double sum = 0, sum_at = 0;
  const auto is_used = [&](std::size_t i) { return std::abs(rests[i - begin] - middle) <= most; };
  for (std::size_t i = begin; i < end; ++i) {
    if (!is_used(i)) continue;
    ++out.used;
    pairs[i].is_used = true;
    sum += rests[i - begin] - middle;
    sum_at += pairs[i].at - at;
  }
  out.left_out = end - begin - out.used;
  const auto count = static_cast<double>(out.used);
  const double mean = sum / count, mean_at = sum_at / count;
  double squares = 0, products = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (!is_used(i)) continue;
    const double dx = pairs[i].at - at - mean_at;
    squares += dx * dx;
    products += dx * (rests[i - begin] - middle - mean);
  }
  const double slope = squares > 0 ? products / squares : 0;
  double scatter = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (!is_used(i)) continue;
    const double off = rests[i - begin] - middle - mean - slope * (pairs[i].at - at - mean_at);
    scatter += off * off;
  }
  scatter /= std::max(1.0, count - 2);
  out.offset = middle + mean - slope * mean_at;
  out.rate = rate + slope;
  out.rate_sigma = squares > 0 ? std::sqrt(scatter / squares) : 0;
  // What is constant in the error of a clock's seconds does not become smaller by taking many of them.
  out.sigma = portable::hypot(std::sqrt(scatter / count), portable::hypot(out.rate_sigma * mean_at, sigma));
  return out;
}

std::vector<Pair> pairs_of(const std::vector<SecondSeen>& first, const std::vector<SecondSeen>& other,
                           std::optional<std::pair<HostTime, HostTime>>& begin) {
  std::vector<Pair> out;
  auto there = other.begin();
  for (const SecondSeen& one : first) {
    while (there != other.end() && there->second < one.second) ++there;
    if (there == other.end()) break;
    if (there->second != one.second || (!out.empty() && out.back().second == one.second)) continue;
    const auto is_far = [](HostTime t) {
      return t.time_since_epoch() > kFarthestPair || t.time_since_epoch() < -kFarthestPair;
    };
    if (is_far(one.at) || is_far(there->at)) continue;
    if (!begin) begin = {one.at, there->at};
    const nanoseconds at = there->at - begin->second, difference = one.at - begin->first - at;
    if (!out.empty() && static_cast<double>(at.count()) <= out.back().at) continue;  // a clock that was set back
    out.push_back({static_cast<double>(at.count()), static_cast<double>(difference.count()),
                   portable::hypot(static_cast<double>(one.sigma.count()), static_cast<double>(there->sigma.count())),
                   one.second, false});
  }
  return out;
}

}  // namespace

Result<ClockRelation> ClockRelation::fit(const std::vector<SecondSeen>& first, const std::vector<SecondSeen>& other,
                                         const Config& config) {
  std::optional<std::pair<HostTime, HostTime>> begin;
  std::vector<Pair> pairs = pairs_of(first, other, begin);
  if (pairs.size() < std::max<std::size_t>(config.least_seconds, 2))
    return Error{ErrorCode::Invalid, fmt::format("they have {} seconds of GPS time in common, and {} are needed",
                                                 pairs.size(), config.least_seconds)};
  const double common = common_rate(pairs);
  const double around = 1e9 * static_cast<double>(config.around.count());
  const double span = pairs.back().at, spacing = 1e9 * static_cast<double>(config.spacing.count());
  const auto steps = static_cast<std::size_t>(std::max(1.0, std::ceil(span / spacing)));
  ClockRelation out;
  out.base_ = begin->first - begin->second;
  out.wander_ = config.wander;
  out.common_seconds_ = pairs.size();
  std::size_t from = 0, to = 0;
  for (std::size_t k = 0; k <= steps; ++k) {
    const double at = std::round(span * static_cast<double>(k) / static_cast<double>(steps));
    while (from < pairs.size() && pairs[from].at < at - around) ++from;
    while (to < pairs.size() && pairs[to].at <= at + around) ++to;
    if (to - from < config.least_seconds) continue;  // a gap
    const Line line = fit_line(pairs, from, to, at, common, config);
    const double drive_s = at * 1e-9;
    if (static_cast<double>(line.used) < config.least_share * static_cast<double>(to - from))
      return Error{ErrorCode::Malformed,
                   fmt::format("their clocks contradict each other {:.0f} s after their first common second: {} of {} "
                               "seconds there fit no common rate",
                               drive_s, line.left_out, to - from)};
    if (std::abs(line.rate) > config.rate_limit)
      return Error{ErrorCode::Malformed,
                   fmt::format("their clocks would differ by {:.0f} ppm {:.0f} s after their first common second, more "
                               "than two oscillators can",
                               line.rate * 1e6, drive_s)};
    if (!out.knots_.empty()) {
      const Knot& before = out.knots_.back();
      const double dt = at - static_cast<double>((before.at - OtherTime(begin->second.time_since_epoch())).count());
      const double step = line.offset - out.offsets_ns_.back() - dt * (before.rate + line.rate) / 2;
      if (std::abs(step) > 6 * portable::hypot(line.sigma, before.sigma_ns) + dt * config.step_rate)
        return Error{ErrorCode::Malformed,
                     fmt::format("their clocks step against each other by {:.6f} s about {:.0f} s after their first "
                                 "common second: one of them was set, or counts another second from then on",
                                 step * 1e-9, drive_s)};
    }
    if (line.sigma > static_cast<double>(config.most_sigma.count()))
      return Error{ErrorCode::Unsupported,
                   fmt::format("the difference of their clocks is known to {:.1f} ms only, and {:.0f} ms are needed",
                               line.sigma * 1e-6, to_seconds(config.most_sigma) * 1e3)};
    const nanoseconds since(static_cast<std::int64_t>(at));
    out.knots_.push_back({OtherTime(begin->second.time_since_epoch()) + since,
                          out.base_ + nanoseconds(std::llround(line.offset)), line.rate, line.sigma, line.rate_sigma,
                          line.used, line.left_out});
    out.offsets_ns_.push_back(line.offset);
  }
  if (out.knots_.empty())
    return Error{ErrorCode::Invalid, "the seconds of GPS time that they have in common lie too far apart"};
  out.left_out_ =
      static_cast<std::size_t>(std::ranges::count_if(pairs, [](const Pair& pair) { return !pair.is_used; }));
  return out;
}

OtherTime ClockRelation::possible(OtherTime other) {
  return std::clamp(other, OtherTime(-kFarthest), OtherTime(kFarthest));
}

ClockRelation::Place ClockRelation::place_of(OtherTime other) const {
  const auto after = std::ranges::upper_bound(knots_, other, {}, &Knot::at);
  Place out;
  out.right = std::min(static_cast<std::size_t>(after - knots_.begin()), knots_.size() - 1);
  out.left = after == knots_.begin() ? 0 : static_cast<std::size_t>(after - knots_.begin()) - 1;
  out.after_left = static_cast<double>((other - knots_[out.left].at).count());
  out.before_right = static_cast<double>((knots_[out.right].at - other).count());
  return out;
}

HostTime ClockRelation::convert(OtherTime other) const {
  if (knots_.empty()) return HostTime(other.time_since_epoch());
  other = possible(other);
  const HostTime same(other.time_since_epoch());
  const Place place = place_of(other);
  const double rate = place.left == place.right
                          ? knots_[place.left].rate
                          : (offsets_ns_[place.right] - offsets_ns_[place.left]) /
                                static_cast<double>((knots_[place.right].at - knots_[place.left].at).count());
  return same + base_ + nanoseconds(std::llround(offsets_ns_[place.left] + rate * place.after_left));
}

nanoseconds ClockRelation::sigma(OtherTime other) const {
  if (knots_.empty()) return nanoseconds(0);
  const Place place = place_of(possible(other));
  const Knot &left = knots_[place.left], &right = knots_[place.right];
  const double away = std::min(std::abs(place.after_left), std::abs(place.before_right));
  const double base = std::max(left.sigma_ns, right.sigma_ns), rate = std::max(left.rate_sigma, right.rate_sigma);
  return nanoseconds(
      static_cast<std::int64_t>(std::ceil(portable::hypot(base, portable::hypot(rate * away, wander_ * away)))));
}

double ClockRelation::rate() const {
  if (knots_.empty()) return 0;
  const double span = static_cast<double>((knots_.back().at - knots_.front().at).count());
  return span > 0 ? (offsets_ns_.back() - offsets_ns_.front()) / span : knots_.front().rate;
}

}  // namespace hueline::sync
