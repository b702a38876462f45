#include "sync/arrival_line.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/portable_math.hpp"

namespace hueline::sync {

std::string ArrivalLine::Config::validate() const {
  if (bucket < std::chrono::milliseconds(10) || bucket > std::chrono::seconds(60))
    return "bucket must be 10 ms to 60 s";
  if (buckets < 4 || buckets > 4096) return "buckets must be 4 to 4096";
  if (!(rate_limit > 0 && rate_limit <= 0.01)) return "rate_limit must be above 0 and at most 0.01";
  if (jump < std::chrono::milliseconds(1)) return "jump must be at least 1 ms";
  if (jump_confirmations < 2) return "jump_confirmations must be at least 2";
  return {};
}

void ArrivalLine::reset() {
  window_.clear();
  jumps_ = 0;
  pairs_ = 0;
}

nanoseconds ArrivalLine::span() const {
  return window_.empty() ? nanoseconds(0)
                         : nanoseconds(static_cast<std::int64_t>(window_.back().x - window_.front().x));
}

bool ArrivalLine::add(std::int64_t x_ns, std::int64_t y_ns) {
  if (window_.empty()) {
    x0_ = x_ns;
    delay0_ = y_ns - x_ns;
  } else if (std::abs(static_cast<double>(y_ns - x_ns) - static_cast<double>(at(x_ns)->delay_ns)) >
             static_cast<double>(config_.jump.count())) {
    if (++jumps_ < config_.jump_confirmations) return false;
    reset();
    ++restarts_;
    x0_ = x_ns;
    delay0_ = y_ns - x_ns;
  }
  jumps_ = 0;
  ++pairs_;
  const double x = static_cast<double>(x_ns - x0_), delay = static_cast<double>(y_ns - x_ns - delay0_);
  const std::int64_t width = config_.bucket.count();
  const std::int64_t relative = x_ns - x0_;
  const std::int64_t index = relative >= 0 ? relative / width : -((-relative + width - 1) / width);
  bool changed = false;
  if (window_.empty() || index > window_.back().index) {
    window_.push_back({index, x, delay});
    changed = true;
  } else {
    // Arrivals of one stream are nearly in order. An event that is older than the newest bucket goes into its own
    // bucket.
    for (auto it = window_.rbegin(); it != window_.rend() && it->index >= index; ++it)
      if (it->index == index && delay < it->delay) {
        *it = {index, x, delay};
        changed = true;
      }
  }
  while (window_.back().index - window_.front().index >= config_.buckets) window_.pop_front();
  if (changed) fit();
  return true;
}

void ArrivalLine::fit() {
  const double first = window_.front().x, last = window_.back().x, span = last - first;
  const auto lowest = std::min_element(window_.begin(), window_.end(),
                                       [](const Bucket& a, const Bucket& b) { return a.delay < b.delay; });
  if (window_.size() < 8) {
    line_x_ = lowest->x;
    line_delay_ = lowest->delay;
    slope_ = 0;
    slope_sigma_ = config_.rate_limit / 2;
    std::vector<double> above;
    for (const Bucket& b : window_) above.push_back(b.delay - line_delay_);
    std::nth_element(above.begin(), above.begin() + static_cast<std::ptrdiff_t>(above.size() / 2), above.end());
    scatter_ = above[above.size() / 2];
    return;
  }
  // The lower hull by Andrew's monotone chain. Its edge over the middle of the window is the line with the least sum of
  // delays.
  std::vector<const Bucket*> hull;
  for (const Bucket& b : window_) {
    while (hull.size() >= 2) {
      const Bucket &p = *hull[hull.size() - 2], &q = *hull.back();
      if ((q.x - p.x) * (b.delay - p.delay) - (q.delay - p.delay) * (b.x - p.x) > 0) break;
      hull.pop_back();
    }
    hull.push_back(&b);
  }
  const double middle = 0.5 * (first + last);
  std::size_t edge = 1;
  while (edge + 1 < hull.size() && hull[edge]->x < middle) ++edge;
  const Bucket &p = *hull[edge - 1], &q = *hull[edge];
  slope_ = std::clamp((q.delay - p.delay) / (q.x - p.x), -config_.rate_limit, config_.rate_limit);
  line_x_ = p.x;
  line_delay_ = p.delay;
  std::vector<double> above;
  for (const Bucket& b : window_) above.push_back(b.delay - (line_delay_ + slope_ * (b.x - line_x_)));
  std::nth_element(above.begin(), above.begin() + static_cast<std::ptrdiff_t>(above.size() / 2), above.end());
  scatter_ = std::max(0.0, above[above.size() / 2]);
  line_x_ = middle;
  line_delay_ = p.delay + slope_ * (middle - p.x);
  slope_sigma_ = 2.0 * scatter_ / span;
}

std::optional<ArrivalLine::Estimate> ArrivalLine::at(std::int64_t x_ns) const {
  if (window_.empty()) return {};
  const double dx = static_cast<double>(x_ns - x0_) - line_x_;
  const double delay = line_delay_ + slope_ * dx;
  return Estimate{delay0_ + static_cast<std::int64_t>(std::llround(delay)),
                  portable::hypot(scatter_, slope_sigma_ * dx)};
}

std::optional<std::int64_t> ArrivalLine::event_of(std::int64_t y_ns) const {
  if (window_.empty()) return {};
  const std::int64_t elapsed = y_ns - x0_ - delay0_;  // exact; the rest is small enough for a double
  const double correction = (line_delay_ + slope_ * (static_cast<double>(elapsed) - line_x_)) / (1.0 + slope_);
  return x0_ + elapsed - static_cast<std::int64_t>(std::llround(correction));
}

}  // namespace hueline::sync
