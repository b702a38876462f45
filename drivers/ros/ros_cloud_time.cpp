#include "drivers/ros/ros_cloud_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

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
template <class Value>
Extent extent_of(const RosCloud& cloud, const Value& value_at) {
  Extent out;
  const RosReturns returns(cloud);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto point = cloud.point(i);
    if (!returns.has(point)) continue;
    const double value = value_at(point);
    if (!std::isfinite(value)) continue;
    out.min = std::min(out.min, value);
    out.max = std::max(out.max, value);
  }
  return out;
}

Extent extent_of(const RosCloud& cloud, const RosField& field) {
  return extent_of(cloud, [&](std::span<const std::byte> point) { return value_of(cloud, field, point); });
}

/// Reads the times of points by a rule whose fields the cloud has, in the rule's unit. Whole seconds count from
/// `begin_s`, so that nothing of a date is lost in the sum.
class Times {
 public:
  Times(const RosCloud& cloud, const RosField* field, const RosField* whole, RosTimeUnit unit, double begin_s = 0)
      : cloud_(cloud), field_(field), whole_(whole), second_(1 / seconds_of(unit)), begin_s_(begin_s) {}
  double operator()(std::span<const std::byte> point) const {
    const double value = value_of(cloud_, *field_, point);
    return whole_ ? (value_of(cloud_, *whole_, point) - begin_s_) * second_ + value : value;
  }

 private:
  const RosCloud& cloud_;
  const RosField *field_, *whole_;
  double second_, begin_s_;
};

/// Returns whether a field has one of the names of times, with or without a unit behind it.
bool is_named(const RosField& field, std::string_view name) {
  const std::string its = plain(field.name);
  if (!its.starts_with(name)) return false;
  const std::string_view rest = std::string_view(its).substr(name.size());
  return rest.empty() || std::ranges::find(kUnitWords, rest, &UnitWord::word) != kUnitWords.end();
}

/// Returns the unit that a name ends with, behind its last _.
RosTimeUnit unit_in_name(const RosField& field) {
  const auto last = field.name.rfind('_');
  const std::string word = last == std::string::npos ? std::string() : plain(field.name.substr(last));
  const auto* named = std::ranges::find(kUnitWords, word, &UnitWord::word);
  return named == kUnitWords.end() ? RosTimeUnit::Auto : named->unit;
}

/// The fields of the times of points.
struct TimeFields {
  const RosField *field = nullptr, *whole = nullptr;
};

/// Returns the field with the whole seconds to which the values of `rest` are added, or null.
const RosField* find_seconds(const RosCloud& cloud, const RosField& rest) {
  const RosTimeUnit unit = unit_in_name(rest);
  if (unit == RosTimeUnit::Auto || unit == RosTimeUnit::Second) return nullptr;
  const auto stem = std::string_view(rest.name).substr(0, rest.name.rfind('_') + 1);
  for (const RosField& one : cloud.fields) {
    const bool is_beside = unit_in_name(one) == RosTimeUnit::Second && one.name.rfind('_') + 1 == stem.size() &&
                           one.name.starts_with(stem);
    if (!is_beside || !is_whole(one)) continue;
    // What a second does not hold is a time of its own.
    const Extent extent = extent_of(cloud, rest);
    if (extent.min >= 0 && extent.max * seconds_of(unit) < 1) return &one;
  }
  return nullptr;
}

/// Returns the first field of times whose values differ.
TimeFields find_times(const RosCloud& cloud) {
  for (const std::string_view name : kNames)
    for (const RosField& field : cloud.fields) {
      if (!is_named(field, name)) continue;
      if (const RosField* whole = find_seconds(cloud, field)) return {&field, whole};
    }
  for (const std::string_view name : kNames)
    for (const RosField& field : cloud.fields)
      if (is_named(field, name) && extent_of(cloud, field).span() > 0) return {&field, nullptr};
  return {};
}

RosTimeUnit unit_of(const RosField& field, const Extent& extent) {
  if (const RosTimeUnit named = unit_in_name(field); named != RosTimeUnit::Auto) return named;
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
  const std::string begin =
      fmt::format("times of the points: {}, {} ",
                  rule.seconds_field.empty() ? rule.field : rule.seconds_field + " and " + rule.field,
                  rule.seconds_field.empty() ? word_of(rule.unit) : fmt::format("s and {}", word_of(rule.unit)));
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
  const auto named = [&](const std::string& name) { return name.empty() ? nullptr : cloud.find(name); };
  const TimeFields fields =
      known.field.empty() ? find_times(cloud) : TimeFields{named(known.field), named(known.seconds_field)};
  if (!fields.field) return RosTimeRule{};
  known.field = fields.field->name;
  if (fields.whole) known.seconds_field = fields.whole->name;
  if (known.unit == RosTimeUnit::Auto) known.unit = unit_of(*fields.field, extent_of(cloud, *fields.field));
  const Extent extent = extent_of(cloud, Times(cloud, fields.field, fields.whole, known.unit));
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
  const RosField* whole = rule.seconds_field.empty() ? nullptr : cloud.find(rule.seconds_field);
  for (const auto& [name, found] : {std::pair(&rule.field, field), std::pair(&rule.seconds_field, whole)})
    if (!found && !name->empty() && cloud.size() > 0)
      return Error{ErrorCode::Malformed, fmt::format("a point cloud without the field {} of its times", *name)};
  // Dates count from the whole second before header.stamp: so nothing of them is lost in the subtraction.
  const auto stamp = cloud.header.stamp.time_since_epoch();
  const auto second = std::chrono::floor<std::chrono::seconds>(stamp);
  const double unit = seconds_of(rule.unit);
  const double begin_s = rule.zero == RosTimeZero::Date ? static_cast<double>(second.count()) : 0;
  const Times time_of(cloud, field, whole, rule.unit, begin_s);
  double zero = whole ? 0 : begin_s / unit;
  if (field && rule.zero == RosTimeZero::First && !cloud.time_base) zero = extent_of(cloud, time_of).min;
  const nanoseconds shift = rule.zero == RosTimeZero::Date ? second - stamp
                            : rule.zero == RosTimeZero::Stamp && cloud.time_base
                                ? cloud.time_base->time_since_epoch() - stamp
                                : nanoseconds(0);
  const double longest = kFarthest_s * 1e9;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto point = cloud.point(i);
    if (!returns.has(point)) continue;
    double ns = 0;
    if (field) ns = (time_of(point) - zero) * unit * 1e9 + static_cast<double>(shift.count());
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
