#include "drivers/ublox/ublox_high_rate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/portable_math.hpp"
#include "drivers/ublox/ubx_fields.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using ubx::accuracy;
using ubx::angle;
using ubx::millis;

constexpr std::uint8_t kHnrPvt = 0x00, kHnrAtt = 0x01;
constexpr std::size_t kHnrPvtBytes = 72, kHnrAttBytes = 32;
constexpr std::int64_t kHnrWeekMs = kSecondsPerWeek * 1000;
constexpr std::uint8_t kOnlyInertial = 1, kGnssAndInertial = 4;  // kinds of fix
constexpr double kLongestStep_s = 1.5;    // between two epochs whose places tell where the vehicle goes
constexpr double kShortestStep_m = 0.05;  // that has a direction: places have steps of 11 mm
constexpr double kSameSpeed_m_s = 0.1;    // by which the speeds of a step and of the message may differ, or
constexpr double kSameSpeedShare = 0.25;  // by this share

/// Returns the time that HNR-PVT says: the week by its calendar, the rest by its time of week unless the calendar,
/// which has nanoseconds, agrees with it. Nothing: it does not know the date.
std::optional<GpsTime> time_of_hnr(std::span<const std::byte> payload, std::uint32_t itow_ms,
                                   std::optional<std::chrono::seconds> utc_offset) {
  const auto u8 = [&](std::size_t at) { return static_cast<int>(stream_field<std::uint8_t>(payload, at)); };
  const auto nanosecond = stream_field<std::int32_t>(payload, 12);
  if ((u8(11) & 3) != 3 || std::abs(std::int64_t{nanosecond}) > 1'000'000'000) return {};
  const auto whole =
      from_utc({stream_field<std::uint16_t>(payload, 4), u8(6), u8(7), u8(8), u8(9), u8(10), 0}, utc_offset);
  if (!whole) return {};
  const GpsTime by_calendar = *whole + nanoseconds(nanosecond);
  const milliseconds tow(itow_ms);
  const std::int64_t week = std::llround(to_seconds(by_calendar.time_since_epoch() - tow) / kSecondsPerWeek);
  const GpsTime by_week = from_gps_week(static_cast<int>(week), tow);
  return std::chrono::abs(by_calendar - by_week) > milliseconds(500) ? by_week : by_calendar;
}

}  // namespace

void UbloxHighRate::forget() {
  motion_.reset();
  turn_.reset();
  joined_itow_.reset();
  course_ = {0, 1};
  knows_course_ = false;
  climbs_.reset();
}

/// Learns from the step since the epoch before where the vehicle goes, relative to its heading, and whether it climbs.
/// A step that a correction of the position has made longer or shorter says nothing.
void UbloxHighRate::learn_course(const std::optional<Motion>& before, const Motion& now) {
  if (!before) return;
  const double step_s = to_seconds(now.solution.time - before->solution.time);
  if (step_s <= 0 || step_s > kLongestStep_s) return;
  const Eigen::Vector3d step =
      (ecef_from_enu(before->solution.position).inverse() * to_ecef(now.solution.position)).xyz;
  const auto is_same = [&](double moved_m, double speed) {
    return std::abs(moved_m / step_s - speed) <= std::max(kSameSpeed_m_s, kSameSpeedShare * speed);
  };
  const double level_m = step.head<2>().norm();
  if (!is_same(level_m, now.plane) || !is_same(std::abs(step.z()), now.slope)) return;
  climbs_ = step.z() < 0 ? -1 : 1;
  const Eigen::Vector2d heading = before->along + now.along;  // in the middle of the step
  if (level_m < kShortestStep_m || heading.norm() < 0.1) return;
  const Eigen::Vector2d ahead = heading / heading.norm(), course = step.head<2>() / level_m;
  course_ = {course.x() * ahead.y() - course.y() * ahead.x(), course.dot(ahead)};
  knows_course_ = true;
}

UbloxHighRate::Taken UbloxHighRate::take(std::uint8_t id, std::span<const std::byte> payload, HostTime received,
                                         const Known& known) {
  const std::size_t least = id == kHnrPvt ? kHnrPvtBytes : kHnrAttBytes;
  if (id > kHnrAtt || payload.size() < least) return {};
  const auto itow = stream_field<std::uint32_t>(payload, 0);
  if (itow >= kHnrWeekMs) return {};  // the receiver does not know the time of the week yet
  Taken taken;
  taken.is_used = true;
  if (id == kHnrAtt) {
    turn_ = Turn{itow, {angle(payload, 8), angle(payload, 12), angle(payload, 16)}, {}};
    for (std::size_t i = 0; i < 3; ++i) turn_->sigma[i] = accuracy(payload, 20 + 4 * i, 1e-5) * kRadPerDeg;
    taken.solution = join(known);
    return taken;
  }
  const auto before = std::exchange(motion_, {});
  taken.time = time_of_hnr(payload, itow, known.utc_offset);
  if (!taken.time) {
    taken.is_used = false;
    return taken;
  }
  Motion& motion = motion_.emplace();
  motion.itow_ms = itow;
  InsSolution& solution = motion.solution;
  solution.time = *taken.time;
  solution.received = received;
  solution.position = ubx::place(payload, 20);
  motion.velocity_sigma = accuracy(payload, 60, 1e-3) / std::numbers::sqrt3;
  motion.along = {portable::sin(angle(payload, 44)), portable::cos(angle(payload, 44))};
  motion.plane = millis(payload, 36);
  const double space = millis(payload, 40);
  motion.slope = std::sqrt(std::max(0.0, space * space - motion.plane * motion.plane));
  learn_course(before, motion);
  const double up = climbs_ ? *climbs_ * motion.slope : 0;
  solution.velocity_enu = {motion.plane * (motion.along.x() * course_.y() + motion.along.y() * course_.x()),
                           motion.plane * (motion.along.y() * course_.y() - motion.along.x() * course_.x()), up};
  const std::array<double, 3> place = ubx::axes(accuracy(payload, 52, 1e-3), accuracy(payload, 56, 1e-3));
  const double level_sigma = knows_course_ ? motion.velocity_sigma : std::max(motion.plane, motion.velocity_sigma);
  const double up_sigma = climbs_ ? motion.velocity_sigma : std::max(motion.slope, motion.velocity_sigma);
  solution.sigma = {{place[0], place[1], place[2], level_sigma, level_sigma, up_sigma, 0, 0, 0}};
  const auto kind = stream_field<std::uint8_t>(payload, 16), flags = stream_field<std::uint8_t>(payload, 17);
  solution.status = kind;
  motion.is_good = (flags & 0x11) == 0x11 && (kind == kOnlyInertial || kind == kGnssAndInertial);
  taken.solution = join(known);
  return taken;
}

/// Returns the solution of the epoch that both messages have told, once.
std::optional<InsSolution> UbloxHighRate::join(const Known& known) {
  if (!motion_ || !turn_ || motion_->itow_ms != turn_->itow_ms || joined_itow_ == motion_->itow_ms) return {};
  joined_itow_ = motion_->itow_ms;
  InsSolution solution = motion_->solution;
  solution.attitude = turn_->attitude;
  for (std::size_t i = 0; i < 3; ++i) (*solution.sigma)[6 + i] = turn_->sigma[i];
  solution.is_good = motion_->is_good && known.fusion_mode.value_or(1) == 1;
  return solution;
}

}  // namespace hueline::drivers
