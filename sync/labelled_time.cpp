#include "sync/labelled_time.hpp"

#include <algorithm>

#include "core/calendar.hpp"

namespace hueline::sync {
namespace {

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// Returns the instant nearest to `near` at which the counter has its value, on the time scale from whose zero its
/// periods count.
template <class TimePoint>
TimePoint nearest(const LaserCounter& counter, TimePoint near) {
  const nanoseconds behind = near.time_since_epoch() - counter.value + counter.period / 2;
  return TimePoint(floor_div(behind.count(), counter.period.count()) * counter.period + counter.value);
}

}  // namespace

std::optional<GpsTime> instant_of(const LaserTime& time, GpsTime near, std::chrono::seconds utc_offset) {
  if (const auto* gps = std::get_if<GpsTime>(&time)) return *gps;
  if (const auto* utc = std::get_if<UnixTime>(&time)) return from_unix(*utc, utc_offset);
  const auto& counter = std::get<LaserCounter>(time);
  if (counter.origin == CounterOrigin::Own) return {};
  if (counter.origin == CounterOrigin::Gps) return nearest(counter, near);
  return from_unix(nearest(counter, to_unix(near, utc_offset)), utc_offset);
}

void LabelledTime::set_period(nanoseconds period) {
  same_ = std::min<nanoseconds>(std::chrono::minutes(30), period / 2);
}

bool LabelledTime::add(GpsTime second, HostTime received) {
  const Candidate label{second, received};
  const auto agrees = [&](const std::optional<Candidate>& known) {
    return known && std::chrono::abs(known->at(received) - second) < same_;
  };
  if (agrees(settled_)) {
    settled_ = label;
    challenger_.reset();
    return false;
  }
  const int in_a_row = agrees(challenger_) ? challenger_->in_a_row + 1 : 1;
  challenger_ = label;
  challenger_->in_a_row = in_a_row;
  if (in_a_row < agreeing_) return false;
  const bool changed = settled_.has_value();
  settled_ = challenger_;
  challenger_.reset();
  return changed;
}

void LabelledTime::settle() {
  if (!settled_) settled_ = challenger_;
  challenger_.reset();
}

std::optional<GpsTime> LabelledTime::near(HostTime received) const {
  if (!settled_) return {};
  return settled_->at(received);
}

}  // namespace hueline::sync
