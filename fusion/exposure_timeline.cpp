#include "fusion/exposure_timeline.hpp"

#include <algorithm>
#include <utility>

namespace hueline::fusion {
namespace {
constexpr std::size_t kMeasuredIntervals =
    9;  // number of intervals in the median; up to four lost images among nine do not enlarge T
}

bool Moment::is_whole() const {
  return std::all_of(has_image.begin(), has_image.end(), [](std::uint8_t has) { return has != 0; });
}

bool Moment::is_spread() const {
  return std::any_of(lateness.begin(), lateness.end(), [](float late) { return late != 0.0f; });
}

std::size_t ExposureTimeline::first_at_or_after(GpsTime t) const {
  return static_cast<std::size_t>(std::lower_bound(moments_.begin(), moments_.end(), t,
                                                   [](const Moment& m, GpsTime time) { return m.time < time; }) -
                                  moments_.begin());
}

void ExposureTimeline::measure_interval(GpsTime newest) {
  if (last_time_ && newest > *last_time_ && rule_.interval.count() == 0) {
    intervals_.push_back(newest - *last_time_);
    if (intervals_.size() > kMeasuredIntervals) intervals_.pop_front();
    std::vector<nanoseconds> sorted(intervals_.begin(), intervals_.end());
    std::sort(sorted.begin(), sorted.end());
    interval_ = sorted[(sorted.size() - 1) / 2];
  }
  if (!last_time_ || newest > *last_time_) last_time_ = newest;
}

Moment& ExposureTimeline::add(const Exposure& exposure, std::size_t camera, const RawView& view, std::uint32_t blind) {
  const int near = cameras_ > 1 ? nearest(exposure.exposure_mid, rule_.together) : -1;
  if (near >= 0 && at(near).has_image[camera] == 0) {
    Moment& moment = at(near);
    moment.pictures[camera] = {exposure.index, exposure.image, view, content_of(view)};
    moment.has_image[camera] = 1;
    moment.blind |= blind;
    return moment;
  }
  Moment moment;
  moment.serial = next_serial_++;
  moment.time = exposure.exposure_mid;
  moment.sigma = exposure.sigma;
  moment.state = exposure.state;
  moment.timing = exposure.timing;
  moment.pictures.resize(cameras_);
  moment.has_image.assign(cameras_, 0);
  moment.pictures[camera] = {exposure.index, exposure.image, view, content_of(view)};
  moment.has_image[camera] = 1;
  moment.blind = blind;
  measure_interval(moment.time);
  // Half an interval earlier is as near to kApart as the next one would be.
  moment.is_step = !last_step_ || std::chrono::abs(moment.time - *last_step_) >= kApart - interval_ / 2;
  if (moment.is_step) last_step_ = moment.time;
  const auto place = moments_.begin() + static_cast<std::ptrdiff_t>(first_at_or_after(moment.time));
  return *moments_.insert(place, std::move(moment));
}

int ExposureTimeline::nearest(GpsTime t, nanoseconds reach) const {
  const std::size_t after = first_at_or_after(t);
  int best = -1;
  if (after < moments_.size() && moments_[after].time - t <= reach) best = static_cast<int>(after);
  if (after > 0) {
    const nanoseconds behind = t - moments_[after - 1].time;
    if (behind < reach && (best < 0 || behind <= moments_[after].time - t)) best = static_cast<int>(after - 1);
  }
  return best;
}

void ExposureTimeline::neighbours_of(GpsTime t, nanoseconds reach, int per_side, int nearest, int except,
                                     std::vector<int>& found) const {
  found.clear();
  auto after = static_cast<int>(first_at_or_after(t));
  int before = after - 1, taken_before = 0, taken_after = 0;
  const int size = static_cast<int>(moments_.size());
  const auto is_left_out = [&](int index, int taken) {
    return index == except || (taken >= nearest && !at(index).is_step);
  };
  for (;;) {
    while (before >= 0 && is_left_out(before, taken_before)) --before;
    while (after < size && is_left_out(after, taken_after)) ++after;
    const bool has_before = before >= 0 && taken_before < per_side && t - at(before).time <= reach;
    const bool has_after = after < size && taken_after < per_side && at(after).time - t <= reach;
    if (!has_before && !has_after) return;
    if (has_before && (!has_after || t - at(before).time <= at(after).time - t)) {
      found.push_back(before--);
      ++taken_before;
    } else {
      found.push_back(after++);
      ++taken_after;
    }
  }
}

bool ExposureTimeline::has_whole_after(GpsTime t) const {
  return std::any_of(moments_.begin() + static_cast<std::ptrdiff_t>(first_at_or_after(t)), moments_.end(),
                     [&](const Moment& moment) { return moment.is_whole() && moment.time > t; });
}

void ExposureTimeline::forget_before(GpsTime time) {
  while (!moments_.empty() && moments_.front().time < time) moments_.pop_front();
}

void ExposureTimeline::keep_steps_before(GpsTime time) {
  std::erase_if(moments_, [&](const Moment& moment) { return moment.time < time && !moment.is_step; });
}

}  // namespace hueline::fusion
