#include "runtime/disk_outlook.hpp"

#include <algorithm>

namespace hueline::runtime {

void DiskOutlook::note(double at_s, std::uint64_t free_bytes) {
  constexpr double kApart_s = 0.9;  // ticks are a second apart, with some jitter
  if (!samples_.empty() && at_s - samples_.back().at_s < kApart_s) return;
  samples_.push_back({at_s, static_cast<double>(free_bytes)});
  while (at_s - samples_.front().at_s > kWindow_s) samples_.pop_front();
}

/// Compares the least free space of the first and of the last quarter. The free space beside a ring rises and falls
/// with its segments, which is no end of the disk.
std::optional<double> DiskOutlook::fill() const {
  if (samples_.empty()) return {};
  const double begin_s = samples_.front().at_s, end_s = samples_.back().at_s, quarter_s = (end_s - begin_s) / 4;
  if (end_s - begin_s < kLeast_s) return {};
  const auto least = [](Sample a, const Sample& b) { return b.free_bytes <= a.free_bytes ? b : a; };
  Sample first = samples_.front(), last = samples_.back();
  for (const Sample& sample : samples_) {
    if (sample.at_s <= begin_s + quarter_s) first = least(first, sample);
    if (sample.at_s >= end_s - quarter_s) last = least(last, sample);
  }
  return std::max(0.0, (first.free_bytes - last.free_bytes) / (last.at_s - first.at_s));
}

}  // namespace hueline::runtime
