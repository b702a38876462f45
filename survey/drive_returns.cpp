#include "survey/drive_returns.hpp"

#include <algorithm>
#include <vector>

namespace hueline::survey {

using namespace calibration;

namespace {

constexpr nanoseconds kPoseEvery{
    2'000'000};                              // between poses, which are joined by straight lines: 0.5 urad at 1 rad/s^2
constexpr nanoseconds kWorstStamp{500'000};  // 4 mm of way at 8 m/s

std::vector<BoresightScanner> scanners_of(const config::Rig& rig) {
  std::vector<BoresightScanner> out;
  for (const auto& laser : rig.geometry.lasers)
    out.push_back({rig.sensor_names()[laser.sensor], laser.T_body_scanner, laser.sigma_range_m});
  return out;
}

nanoseconds span_of(const StampedLaserBatch& batch) {
  std::int32_t last = 0;
  for (const LaserReturn& one : batch.returns) last = std::max(last, one.time_offset_ns);
  return nanoseconds(last);
}

}  // namespace

DriveReturns::DriveReturns(const config::Rig& rig, const ReturnStore::Config& config)
    : store_(scanners_of(rig), config) {
  for (std::size_t i = 0; i < rig.geometry.lasers.size(); ++i) scanners_[rig.geometry.lasers[i].sensor] = i;
}

void DriveReturns::on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) {
  if (!scanners_.contains(batch.sensor)) return;
  if (batch.sigma > kWorstStamp) {
    counts_.badly_timed += batch.returns.size();
    return;
  }
  const std::size_t scanner = scanners_.at(batch.sensor);
  std::vector<std::optional<fusion::Pose>> poses;  // at the batch's time and every step after it
  for (nanoseconds after{0}; after <= span_of(batch) + kPoseEvery; after += kPoseEvery)
    poses.push_back(trajectory.pose_at(batch.time + after).pose);
  for (const LaserReturn& one : batch.returns) {
    const nanoseconds offset{std::max(0, one.time_offset_ns)};
    const auto step = static_cast<std::size_t>(offset / kPoseEvery);
    if (!poses[step] || !poses[step + 1]) {
      ++counts_.no_pose;
      continue;
    }
    const fusion::Pose &a = *poses[step], &b = *poses[step + 1];
    const double share = static_cast<double>((offset % kPoseEvery).count()) / static_cast<double>(kPoseEvery.count());
    const Transform<Enu, Body> T_enu_body{a.T_enu_body.rotation.slerp(share, b.T_enu_body.rotation),
                                          (1 - share) * a.T_enu_body.translation + share * b.T_enu_body.translation};
    store_.add(scanner, {one.x, one.y, one.z}, batch.time + offset, T_enu_body,
               {0, a.sigma_position, a.sigma_attitude});
    ++counts_.placed;
  }
}

}  // namespace hueline::survey
