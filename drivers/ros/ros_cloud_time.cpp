#include "drivers/ros/ros_cloud_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

namespace hueline::drivers {
namespace {

/// Names of fields of times that drivers use, small and without _. A unit may follow: time_offset_ns.
constexpr std::array<std::string_view, 12> kNames{
    "t",         "time",      "timestamp",    "offsettime", "timeoffset", "timestampoffset",
    "timedelta", "deltatime", "relativetime", "stamp",      "ts",         "relativetimestamp"};
struct UnitWord {
  std::string_view word;
  RosTimeUnit unit;
};
constexpr std::array<UnitWord, 8> kUnitWords{{{"ns", RosTimeUnit::Nanosecond},
                                              {"nsec", RosTimeUnit::Nanosecond},
                                              {"us", RosTimeUnit::Microsecond},
                                              {"usec", RosTimeUnit::Microsecond},
                                              {"ms", RosTimeUnit::Millisecond},
                                              {"msec", RosTimeUnit::Millisecond},
                                              {"s", RosTimeUnit::Second},
                                              {"sec", RosTimeUnit::Second}}};
constexpr std::array<RosTimeUnit, 4> kUnits{RosTimeUnit::Second, RosTimeUnit::Millisecond, RosTimeUnit::Microsecond,
                                            RosTimeUnit::Nanosecond};
/// What the points of one message span, s.
constexpr double kShortest_s = 0.002, kLongest_s = 2;
/// How far a date may be from header.stamp, s.
constexpr double kFarthest_s = 10;

bool is_plausible(double span_s) { return span_s >= kShortest_s && span_s < kLongest_s; }

double seconds_of(RosTimeUnit unit) {
  switch (unit) {
    case RosTimeUnit::Millisecond:
      return 1e-3;
    case RosTimeUnit::Microsecond:
      return 1e-6;
    case RosTimeUnit::Nanosecond:
      return 1e-9;
    case RosTimeUnit::Auto:
    case RosTimeUnit::Second:
      break;
  }
  return 1;
}

const char* word_of(RosTimeUnit unit) {
  switch (unit) {
    case RosTimeUnit::Millisecond:
      return "ms";
    case RosTimeUnit::Microsecond:
      return "us";
    case RosTimeUnit::Nanosecond:
      return "ns";
    case RosTimeUnit::Auto:
    case RosTimeUnit::Second:
      break;
  }
  return "s";
}

std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name)
    if (c != '_') out += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return out;
}

/// The smallest and the largest value of a field among the points with a return.
struct Extent {
  double min = std::numeric_limits<double>::infinity(), max = -std::numeric_limits<double>::infinity();
  double span() const { return max - min; }
};
Extent extent_of(const RosCloud& cloud, const RosField& field) {
  Extent out;
  const RosReturns returns(cloud);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto point = cloud.point(i);
    if (!returns.has(point)) continue;
    const double value = value_of(cloud, field, point);
    if (!std::isfinite(value)) continue;
    out.min = std::min(out.min, value);
    out.max = std::max(out.max, value);
  }
  return out;
}

/// Returns whether a field has one of the names of times, with or without a unit behind it.
bool is_named(const RosField& field, std::string_view name) {
  const std::string its = plain(field.name);
  if (!its.starts_with(name)) return false;
  const std::string_view rest = std::string_view(its).substr(name.size());
  return rest.empty() || std::ranges::find(kUnitWords, rest, &UnitWord::word) != kUnitWords.end();
}

/// Returns the first field of times whose values differ.
const RosField* find_times(const RosCloud& cloud) {
  for (const std::string_view name : kNames)
    for (const RosField& field : cloud.fields)
      if (is_named(field, name) && extent_of(cloud, field).span() > 0) return &field;
  return nullptr;
}

RosTimeUnit unit_of(const RosField& field, const Extent& extent) {
  const auto last = field.name.rfind('_');
  const std::string word = last == std::string::npos ? std::string() : plain(field.name.substr(last));
  if (const auto* named = std::ranges::find(kUnitWords, word, &UnitWord::word); named != kUnitWords.end())
    return named->unit;
  for (const RosTimeUnit unit : kUnits)
    if (is_plausible(extent.span() * seconds_of(unit))) return unit;
  return is_whole(field) ? RosTimeUnit::Nanosecond : RosTimeUnit::Second;
}

RosTimeZero zero_of(const RosCloud& cloud, const Extent& extent, double unit_s) {
  const double largest = std::max(std::abs(extent.min), std::abs(extent.max)) * unit_s;
  const double stamp = to_seconds(cloud.header.stamp.time_since_epoch());
  // A Livox that nothing synchronises counts from when it was switched on, and header.stamp is the computer's.
  if (cloud.time_base && count_ns(cloud.header.stamp) != 0) {
    const double base = to_seconds(cloud.time_base->time_since_epoch());
    return std::abs(base - stamp) <= kFarthest_s ? RosTimeZero::Stamp : RosTimeZero::First;
  }
  if (cloud.time_base || largest <= kLongest_s) return RosTimeZero::Stamp;
  return std::abs(extent.max * unit_s - stamp) <= kFarthest_s ? RosTimeZero::Date : RosTimeZero::First;
}

}  // namespace

std::string in_words(const RosTimeRule& rule) {
  if (rule.field.empty()) return "the points have no times of their own";
  const std::string begin = fmt::format("times of the points: {}, {} ", rule.field, word_of(rule.unit));
  if (rule.zero == RosTimeZero::Date) return begin + "since 1970";
  if (rule.zero == RosTimeZero::First)
    return begin + "of a clock that is not header.stamp's; header.stamp is taken for the first point's";
  return begin + "after header.stamp";
}

std::optional<RosTimeRule> recognise_times(const RosCloud& cloud, RosTimeRule known) {
  const RosReturns returns(cloud);
  std::size_t count = 0;
  for (std::size_t i = 0; i < cloud.size() && count < 2; ++i) count += returns.has(cloud.point(i)) ? 1 : 0;
  if (count < 2) return {};
  const RosField* field = known.field.empty() ? find_times(cloud) : cloud.find(known.field);
  if (!field) return RosTimeRule{};
  const Extent extent = extent_of(cloud, *field);
  known.field = field->name;
  if (known.unit == RosTimeUnit::Auto) known.unit = unit_of(*field, extent);
  if (known.zero == RosTimeZero::Auto) known.zero = zero_of(cloud, extent, seconds_of(known.unit));
  return known;
}

RosReturns::RosReturns(const RosCloud& cloud)
    : cloud_(cloud), x_(cloud.find("x")), y_(cloud.find("y")), z_(cloud.find("z")) {}

std::optional<RosReturns::Place> RosReturns::place(std::span<const std::byte> point) const {
  const Place out{value_of(cloud_, *x_, point), value_of(cloud_, *y_, point), value_of(cloud_, *z_, point)};
  // Nothing that a laser measures is farther away. A number that is none is not below it either.
  constexpr double kFarthest_m = 1e6;
  const bool is_near = std::abs(out.x) < kFarthest_m && std::abs(out.y) < kFarthest_m && std::abs(out.z) < kFarthest_m;
  return is_near && (out.x != 0 || out.y != 0 || out.z != 0) ? std::optional(out) : std::nullopt;
}

Result<std::vector<RosPoint>> timed_points(const RosCloud& cloud, const RosTimeRule& rule) {
  std::vector<RosPoint> out;
  const RosReturns returns(cloud);
  const RosField* field = rule.field.empty() ? nullptr : cloud.find(rule.field);
  if (!field && !rule.field.empty() && cloud.size() > 0)
    return Error{ErrorCode::Malformed, fmt::format("a point cloud without the field {} of its times", rule.field)};
  // Dates count from the whole second before header.stamp: so nothing of them is lost in the subtraction.
  const auto stamp = cloud.header.stamp.time_since_epoch();
  const auto second = std::chrono::floor<std::chrono::seconds>(stamp);
  const double unit = seconds_of(rule.unit);
  double zero = rule.zero == RosTimeZero::Date ? static_cast<double>(second.count()) / unit : 0;
  if (field && rule.zero == RosTimeZero::First && !cloud.time_base) zero = extent_of(cloud, *field).min;
  const nanoseconds shift = rule.zero == RosTimeZero::Date ? second - stamp
                            : rule.zero == RosTimeZero::Stamp && cloud.time_base
                                ? cloud.time_base->time_since_epoch() - stamp
                                : nanoseconds(0);
  const double longest = kFarthest_s * 1e9;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto point = cloud.point(i);
    if (!returns.has(point)) continue;
    double ns = 0;
    if (field) ns = (value_of(cloud, *field, point) - zero) * unit * 1e9 + static_cast<double>(shift.count());
    if (!(std::abs(ns) <= longest))
      return Error{ErrorCode::Malformed,
                   fmt::format("a point cloud with a time that is {} s from its header.stamp: not used. {}",
                               std::isfinite(ns) ? fmt::format("{:.3f}", ns * 1e-9) : "no number of", in_words(rule))};
    out.push_back({static_cast<std::uint32_t>(i), std::llround(ns)});
  }
  std::ranges::stable_sort(out, {}, &RosPoint::offset_ns);
  if (!out.empty() && out.back().offset_ns - out.front().offset_ns > static_cast<std::int64_t>(kLongest_s * 1e9))
    return Error{ErrorCode::Malformed,
                 fmt::format("a point cloud whose times span {:.3f} s: not used. {}",
                             static_cast<double>(out.back().offset_ns - out.front().offset_ns) * 1e-9, in_words(rule))};
  return out;
}

}  // namespace hueline::drivers
