#include "runtime/drive_map.hpp"

#include <cmath>

#include "core/portable_math.hpp"

namespace hueline::runtime {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
std::int64_t second_of(GpsTime time) { return count_ns(time) / kSecond_ns; }

}  // namespace

DriveMap::Second* DriveMap::at(std::int64_t gps_second) {
  if (!first_) first_ = gps_second;
  const std::int64_t index = gps_second - *first_;
  if (index < 0 || index >= kMostSeconds) return nullptr;
  if (static_cast<std::size_t>(index) >= seconds_.size()) seconds_.resize(static_cast<std::size_t>(index) + 1);
  return &seconds_[static_cast<std::size_t>(index)];
}

void DriveMap::on_solution(const InsSolution& solution) {
  if (!solution.is_good) return;
  Second* second = at(second_of(solution.time));
  if (second == nullptr) return;
  if (!second->place) second->place = solution.position;
  if (solution.sigma) second->sigma_m = static_cast<float>(portable::hypot((*solution.sigma)[0], (*solution.sigma)[1]));
}

void DriveMap::on_fix(const GnssFix& fix) {
  if (!first_) return;  // the drive begins with a good solution
  if (Second* second = at(second_of(fix.time))) second->fix = fix.type;
}

void DriveMap::on_cloud(const CloudBlock& block) {
  std::int64_t begin_ns = 0;
  Second* second = nullptr;
  for (const ColouredPoint& point : block.points) {
    const std::int64_t ns = count_ns(point.time);
    if (second == nullptr || ns < begin_ns || ns >= begin_ns + kSecond_ns) {
      begin_ns = ns - ns % kSecond_ns;
      second = at(begin_ns / kSecond_ns);
      if (second == nullptr) continue;
    }
    ++second->points;
    second->coloured += point.exposure != kNoExposure ? 1 : 0;
  }
}

}  // namespace hueline::runtime
