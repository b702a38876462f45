// The wrong clocks of the devices.
#include <cmath>

#include "sim/faults/stages.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kNsPerWeek = 604'800 * kNsPerSecond;

std::int64_t seconds_of(double s) { return std::llround(s) * kNsPerSecond; }
GpsNs whole_second(GpsNs t) { return t / kNsPerSecond * kNsPerSecond; }

}  // namespace

double LineErrors::strength(FaultType type, GpsNs t) const {
  double sum = 0;
  for (const FaultLine& line : lines_)
    if (line.type == type && line.covers(t - begin_)) sum += line.strength;
  return sum;
}

double LineErrors::strength(FaultType type, FaultTarget target, GpsNs t) const {
  double sum = 0;
  for (const FaultLine& line : lines_)
    if (line.type == type && line.target == target && line.covers(t - begin_)) sum += line.strength;
  return sum;
}

bool LineErrors::is_on(FaultType type, GpsNs t) const {
  for (const FaultLine& line : lines_)
    if (line.type == type && line.covers(t - begin_)) return true;
  return false;
}

std::int64_t LineErrors::nmea_seconds(GpsNs second) const {
  double sum = 0;
  for (const FaultType type : {FaultType::PpsLabel, FaultType::UtcOffset, FaultType::TaiOffset})
    sum += std::round(strength(type, FaultTarget::LaserStatus, second));
  return std::llround(sum);
}

bool LineErrors::has_nmea(GpsNs second) const { return !is_on(FaultType::NmeaLoss, second); }

std::int64_t LineErrors::nmea_delay_ns(GpsNs second) const {
  // The strength is the whole delay after the second; the usual latency is a part of it.
  const double late = strength(FaultType::NmeaLate, second);
  return late > 0 ? std::llround(std::max(0.0, late - 0.3) * 1e9) : 0;
}

std::int64_t LineErrors::scanner_clock_ns(GpsNs t) const {
  // A scanner labels an edge with the sentence that came before the edge. That is the sentence of the second before, if
  // it came in time.
  const GpsNs named_by = whole_second(t) - kNsPerSecond;
  std::int64_t error = 0;
  if (has_nmea(named_by)) {
    error += nmea_seconds(named_by) * kNsPerSecond;
    error -= static_cast<std::int64_t>(std::floor(strength(FaultType::NmeaLate, named_by))) * kNsPerSecond;
  }
  error -= leap_seconds(t) * kNsPerSecond;
  error += std::llround((strength(FaultType::HalfSecond, t) + strength(FaultType::LaserClockStep, t)) * 1e9);
  for (const FaultLine& line : lines_) {
    const std::int64_t drive = t - begin_;
    if (line.type == FaultType::LaserPpsLoss && line.covers(drive))
      error += std::llround(line.strength * 1e-6 * static_cast<double>(drive - line.begin_ns()));
  }
  return error;
}

std::uint8_t LineErrors::scanner_pps_status(GpsNs t) const { return is_on(FaultType::LaserPpsLoss, t) ? 0 : 2; }

std::int64_t LineErrors::receiver_clock_ns(GpsNs t) const {
  return -std::llround(strength(FaultType::WeekRollover, t)) * kNsPerWeek;
}

std::int64_t LineErrors::time_label_ns(GpsNs second) const {
  std::int64_t error = 0;
  for (const FaultType type : {FaultType::PpsLabel, FaultType::UtcOffset, FaultType::TaiOffset})
    error += seconds_of(strength(type, FaultTarget::Pos, second));
  return error;
}

std::int64_t LineErrors::ins_stamp_ns(GpsNs t) const { return seconds_of(strength(FaultType::InsLabel, t)); }

std::uint8_t LineErrors::receiver_time_status(GpsNs t) const {
  constexpr std::uint8_t kCoarse = 100, kFineSteering = 180;
  return is_on(FaultType::ReceiverTimeLost, t) ? kCoarse : kFineSteering;
}

std::uint32_t LineErrors::ins_status(GpsNs t) const {
  return is_on(FaultType::PosNotGood, t) ? static_cast<std::uint32_t>(std::llround(strength(FaultType::PosNotGood, t)))
                                         : 3;
}

int LineErrors::leap_seconds(GpsNs t) const {
  int count = 0;
  for (const FaultLine& line : lines_) {
    const GpsNs from = (begin_ + line.begin_ns() + kNsPerSecond - 1) / kNsPerSecond * kNsPerSecond;
    if (line.type == FaultType::LeapSecond && t >= from) ++count;
  }
  return count;
}

std::size_t LineErrors::concerns(const FaultLine& line) {
  switch (line.type) {
    case FaultType::PpsLabel:
    case FaultType::UtcOffset:
    case FaultType::TaiOffset:
    case FaultType::WeekRollover:
    case FaultType::LeapSecond:
    case FaultType::ReceiverTimeLost:
    case FaultType::NmeaLate:
    case FaultType::NmeaLoss:
    case FaultType::HalfSecond:
    case FaultType::LaserPpsLoss:
    case FaultType::LaserClockStep:
    case FaultType::PosNotGood:
    case FaultType::InsLabel:
      return 1;
    default:
      return 0;
  }
}

}  // namespace hueline::sim
