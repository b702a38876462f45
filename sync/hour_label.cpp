#include "sync/hour_label.hpp"

namespace hueline::sync {
namespace {

constexpr std::int64_t kHourNs = 3'600'000'000'000;
constexpr nanoseconds kSameHour = std::chrono::minutes(30);

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

}  // namespace

GpsTime instant_of(DeviceTime<UtcHourCounter> counter, GpsTime near, std::chrono::seconds utc_offset) {
  const std::int64_t utc_ns = count_ns(near - utc_offset);
  const std::int64_t hour = floor_div(utc_ns - count_ns(counter) + kHourNs / 2, kHourNs);
  return gps_time_ns(hour * kHourNs + count_ns(counter)) + utc_offset;
}

bool HourLabel::add(GpsTime second, HostTime received) {
  const Candidate label{second, received};
  const auto agrees = [&](const std::optional<Candidate>& known) {
    return known && std::chrono::abs(known->at(received) - second) < kSameHour;
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

void HourLabel::settle() {
  if (!settled_) settled_ = challenger_;
  challenger_.reset();
}

std::optional<GpsTime> HourLabel::near(HostTime received) const {
  if (!settled_) return {};
  return settled_->at(received);
}

}  // namespace hueline::sync
