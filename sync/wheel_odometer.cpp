#include "sync/wheel_odometer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/portable_math.hpp"

namespace hueline::sync {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr nanoseconds kPosGap = milliseconds(500);
constexpr double kStanding = 0.05;          // m/s; slower motion is noise of the POS
constexpr std::size_t kPosPoints = 20'000;  // 100 s at 200 Hz
constexpr std::size_t kWindows = 64;

}  // namespace

void WheelOdometer::Config::visit(Keys& keys) {
  keys.duration(
      {"stamp_delay_us", "us", "The mean time from the end of a frame on the bus to its time stamp. It is subtracted."},
      stamp_delay, {-1000, 1e6});
  keys.duration({"stamp_sigma_us", "us",
                 "One standard deviation of the time stamp. An adapter on USB is read every millisecond; one on PCI or "
                 "SPI is better."},
                stamp_sigma, {0.01, 1e6});
  keys.duration({"age_ms", "ms", "The age of a value when its frame ends: half of the time over which it is averaged."},
                age, {0, 1000});
}

KeyError WheelOdometer::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (silence < milliseconds(10) || silence > seconds(60)) return {"silence", "must be 10 ms to 60 s"};
  if (window < milliseconds(500) || window > seconds(60)) return {"window", "must be 0.5 s to 60 s"};
  if (!(tolerance_m >= 0.01 && tolerance_m <= 100)) return {"tolerance_m", "must be 0.01 to 100"};
  if (!(tolerance_share >= 0 && tolerance_share <= 1)) return {"tolerance_share", "must be 0 to 1"};
  return {"", adapter.validate()};
}

WheelOdometer::WheelOdometer(Config config) : config_(config), line_(config.adapter) {}

std::optional<GpsStamp> WheelOdometer::stamp(const WheelSpeed& wheel, const HostClockModel& clock) {
  HostTime at = wheel.received;
  double line_sigma_ns = 0;
  if (wheel.adapter_time) {
    const std::int64_t x = count_ns(*wheel.adapter_time);
    line_.add(x, count_ns(wheel.received));
    if (const auto estimate = line_.at(x)) {
      at = std::min(at, host_time_ns(x + estimate->delay_ns));
      line_sigma_ns = estimate->sigma_ns;
    }
  }
  auto out = clock.stamp(at - config_.stamp_delay);
  if (!out) return {};
  out->time -= config_.age;
  const auto sigma = [](nanoseconds s) { return static_cast<double>(s.count()); };
  out->sigma = nanoseconds(std::llround(portable::hypot(sigma(out->sigma), sigma(config_.stamp_sigma), line_sigma_ns)));
  return out;
}

void WheelOdometer::add(WheelSpeed wheel, const HostClockModel& clock, std::vector<StampedWheelSpeed>& out) {
  newest_ = std::max(newest_, wheel.received);
  const auto stamped = stamp(wheel, clock);
  if (!stamped) return;
  is_directional_ |= wheel.is_directional;
  if (last_message_ && stamped->time - *last_message_ > config_.silence)
    faults_.add(config_.sensor, FaultKind::Silent, "silence", wheel.received,
                fmt::format("no word of the wheels for {:.2f} s", to_seconds(stamped->time - *last_message_)));
  last_message_ = last_message_ ? std::max(*last_message_, stamped->time) : stamped->time;
  if (wheel.speed) {
    ++speeds_.way.messages;
    // The speed is linear between two messages; across a long gap no distance is added.
    const nanoseconds dt = speeds_.last ? stamped->time - speeds_.last->time : nanoseconds(0);
    if (!speeds_.last || dt < nanoseconds(0) || dt > config_.silence)
      extend_over_gap(speeds_, stamped->time, 0);
    else
      extend(speeds_, stamped->time, 0.5 * (*last_speed_ + *wheel.speed) * to_seconds(dt));
    last_speed_ = wheel.speed;
  }
  if (wheel.distance_m) {
    ++pulses_.way.messages;
    const double metres = last_distance_ ? *wheel.distance_m - *last_distance_ : 0;
    const nanoseconds dt = pulses_.last ? stamped->time - pulses_.last->time : nanoseconds(0);
    // The encoder continues to count in a gap. If its counter may have wrapped, the decoder reports it and leaves them
    // out.
    if (!pulses_.last || dt < nanoseconds(0) || dt > config_.silence)
      extend_over_gap(pulses_, stamped->time, metres);
    else
      extend(pulses_, stamped->time, metres);
    last_distance_ = wheel.distance_m;
  }
  out.push_back({stamped->time, stamped->sigma, stamped->state, std::move(wheel)});
  compare(speeds_, false);
  compare(pulses_, false);
}

void WheelOdometer::extend_over_gap(Track& track, GpsTime time, double metres) {
  track.way.wheels_m += metres;
  track.last = Point{time, (track.last ? track.last->metres : 0) + metres, 0};
  track.begin.reset();
}

void WheelOdometer::extend(Track& track, GpsTime time, double metres) {
  const Point here{time, track.last->metres + metres, 0};
  track.way.wheels_m += metres;
  if (!track.begin) track.begin = track.last;
  track.last = here;
  if (time - track.begin->time < config_.window) return;
  if (track.windows.size() == kWindows) track.windows.pop_front();  // without a POS there is nothing to compare with
  track.windows.emplace_back(*track.begin, here);
  track.begin = here;
}

void WheelOdometer::add(const InsSolution& solution) {
  const bool is_first = pos_.empty();
  if (!is_first && solution.time <= pos_.back().time) {
    // This is the same moment in another log, or a clock that fell back. If it fell far, the distance starts again.
    if (solution.time > pos_.back().time - seconds(1)) return;
    pos_.clear();
    ++pos_piece_;
  }
  if (!solution.is_good) {
    pos_was_good_ = false;
    return;
  }
  const double heading = solution.attitude.heading;
  const double along =
      solution.velocity_enu.x() * portable::sin(heading) + solution.velocity_enu.y() * portable::cos(heading);
  const double speed = std::abs(along) < kStanding ? 0 : is_directional_ ? along : std::abs(along);
  double metres = 0;
  if (!pos_.empty()) {
    const nanoseconds dt = solution.time - pos_.back().time;
    metres = pos_.back().metres;
    if (!pos_was_good_ || dt > kPosGap)
      ++pos_piece_;
    else
      metres += 0.5 * (pos_speed_ + speed) * to_seconds(dt);
  }
  pos_speed_ = speed;
  pos_was_good_ = true;
  pos_.push_back({solution.time, metres, pos_piece_});
  if (pos_.size() > kPosPoints) pos_.pop_front();
  // Removes what no current or waiting window needs. Without wheels, a second is kept.
  GpsTime needed = solution.time - seconds(1) - 2 * config_.window;
  for (const Track* track : {&speeds_, &pulses_})
    if (!track->windows.empty()) needed = std::min(needed, track->windows.front().first.time - seconds(1));
  while (pos_.size() > 2 && pos_[1].time < needed) pos_.pop_front();
}

/// Returns the POS's distance between two times; nothing if it is not known throughout.
std::optional<double> WheelOdometer::pos_way(const Point& from, const Point& to) const {
  std::optional<Point> ends[2];
  const GpsTime times[2] = {from.time, to.time};
  for (int i = 0; i < 2; ++i) {
    const auto after =
        std::lower_bound(pos_.begin(), pos_.end(), times[i], [](const Point& p, GpsTime t) { return p.time < t; });
    if (after == pos_.end() || (after == pos_.begin() && after->time != times[i])) return {};
    if (after->time == times[i]) {
      ends[i] = *after;
      continue;
    }
    const Point& a = *(after - 1);
    if (a.piece != after->piece) return {};
    const double part = to_seconds(times[i] - a.time) / to_seconds(after->time - a.time);
    ends[i] = Point{times[i], a.metres + part * (after->metres - a.metres), a.piece};
  }
  if (ends[0]->piece != ends[1]->piece) return {};
  return ends[1]->metres - ends[0]->metres;
}

void WheelOdometer::compare(Track& track, bool is_end) {
  while (!track.windows.empty()) {
    const auto& [from, to] = track.windows.front();
    if (!is_end && (pos_.empty() || pos_.back().time < to.time)) return;
    if (const auto pos = pos_way(from, to)) {
      const double wheels = to.metres - from.metres, window_s = to_seconds(to.time - from.time);
      Way& way = track.way;
      way.compared_wheels_m += wheels;
      way.compared_pos_m += *pos;
      way.compared_s += window_s;
      if (std::abs(wheels - *pos) >
          config_.tolerance_m + config_.tolerance_share * std::max(std::abs(wheels), std::abs(*pos))) {
        way.disagreeing_s += window_s;
        faults_.add(config_.sensor, FaultKind::Implausible, track.name, newest_,
                    fmt::format("by its {} the vehicle went {:.2f} m in {:.2f} s, by the POS {:.2f} m: stuck or "
                                "slipping wheel, wrong scale, or a wrong POS",
                                track.name, wheels, window_s, *pos));
      }
    }
    track.windows.pop_front();
  }
}

void WheelOdometer::flush() {
  for (Track* track : {&speeds_, &pulses_}) {
    // The last window is shorter.
    if (track->begin && track->last && track->last->time - track->begin->time > milliseconds(100))
      track->windows.emplace_back(*track->begin, *track->last);
    compare(*track, true);
  }
  faults_.flush();
}

}  // namespace hueline::sync
