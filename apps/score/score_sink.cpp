#include "apps/score/score_sink.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "apps/simulate/point_claim.hpp"
#include "apps/simulate/simulated_recording.hpp"

namespace hueline::apps {
namespace {

/// A number that no true exposure has, for a point whose exposure is unknown.
constexpr std::uint32_t kUnknownExposure = 0xFFFFFFFFu;

}  // namespace

ScoreSink::ScoreSink(score::Scorer& scorer, const config::Rig& rig, GpsTime drive_begin)
    : scorer_(scorer),
      is_panorama_(rig.colouring.method == fusion::ColourMethod::Panorama),
      T_body_head_(rig.geometry.head.T_body_head),
      drive_begin_(drive_begin),
      pos_(rig.sync.pos) {}

void ScoreSink::on_exposure(const Exposure& exposure) {
  if (exposure.timing == ExposureTiming::Unmatched) return;
  if (!first_exposure_) first_exposure_ = now_;
  const auto number = image_numbers_.find(exposure.image.packet_sequence);
  if (number == image_numbers_.end()) return;
  stamped_.insert_or_assign(exposure.index, Stamped{number->second, exposure.exposure_mid, exposure.sigma,
                                                    exposure.image.received, exposure.image.is_complete});
}

void ScoreSink::on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  const auto stamped = stamped_.find(exposure.index);
  const auto [pose, reason] = trajectory.pose_at(exposure.exposure_mid);
  if (stamped == stamped_.end() || !pose) return;
  const Transform<Ecef, CameraHead> T = ecef_from_enu(*trajectory.origin()) * (pose->T_enu_body * T_body_head_);
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = T.rotation.toRotationMatrix();
  sim::Pose& out = stamped->second.T_ecef_head.emplace();
  std::copy(R.data(), R.data() + 9, out.R.m.begin());
  out.p = vec3(T.translation);
}

void ScoreSink::on_fault(const Fault& fault) {
  if (fault.kind != FaultKind::Lost) return;
  // The camera's matcher reports a missing mark, but the lost units are two of the POS: MARK1TIME and MARK1PVA.
  const bool is_mark = fault.sensor != pos_ && fault.detail.find("mark") != std::string::npos;
  told_lost_[is_mark ? pos_ : fault.sensor] += fault.count * (is_mark ? 2 : 1);
}

void ScoreSink::on_cloud(const CloudBlock& block, const fusion::Trajectory&) {
  const auto T_ecef_enu = ecef_from_enu(block.origin);
  for (const ColouredPoint& point : block.points) take(point, T_ecef_enu);
}

void ScoreSink::on_provisional_cloud(const CloudBlock& block, const fusion::Trajectory&) {
  for (const ColouredPoint& point : block.points)
    if (const auto latency = latency_ms(point)) scorer_.add_provisional(*latency);
}

void ScoreSink::on_sights(const CloudBlock& block, std::span<const fusion::JudgedSight> sights) {
  for (const fusion::JudgedSight& sight : sights) {
    const auto exposure = stamped_.find(sight.exposure);
    if (exposure == stamped_.end()) continue;
    const ColouredPoint& point = block.points[sight.point];
    scorer_.add(score::SightClaim{point.channel,
                                  count_ns(point.time),
                                  exposure->second.number,
                                  sight.lens,
                                  {sight.evidence.begin(), sight.evidence.end()}});
  }
}

void ScoreSink::on_laser(const StampedLaserBatch&) {
  if (!first_laser_) first_laser_ = now_;
}

/// Returns the time since the last input that a coloured point needs; empty for points without a colour, and after the
/// stream's end.
std::optional<double> ScoreSink::latency_ms(const ColouredPoint& point) const {
  if (point.exposure == kNoExposure || !now_) return std::nullopt;
  // What came before the clock had locked and the camera's images were matched could not be placed or coloured earlier.
  HostTime needed = std::max({kSimulatedHostBegin + (point.time - drive_begin_), first_laser_.value_or(*now_),
                              first_exposure_.value_or(*now_)});
  if (const auto exposure = stamped_.find(point.exposure); exposure != stamped_.end())
    needed = std::max(needed, exposure->second.arrived);
  return to_seconds(*now_ - needed) * 1e3;
}

void ScoreSink::take(const ColouredPoint& point, const Transform<Ecef, Enu>& T_ecef_enu) {
  cloud_.add(point);
  const auto exposure = stamped_.find(point.exposure);
  score::PointClaim out;
  out.claim = claim_of(point, T_ecef_enu, exposure == stamped_.end() ? kUnknownExposure : exposure->second.number,
                       is_panorama_);
  out.is_coloured = point.exposure != kNoExposure;
  out.moving = point.moving;
  out.latency_ms = latency_ms(point);
  scorer_.add(out);
}

void ScoreSink::finish() {
  std::set<std::uint32_t> numbers;
  for (const auto& [index, stamped] : stamped_) {
    // A camera that hangs sends an image again as that of another exposure. The time of that exposure is correct, but
    // its image is never used.
    if (!numbers.insert(stamped.number).second) continue;
    score::ExposureClaim claim;
    claim.number = stamped.number;
    claim.mid_gps_ns = count_ns(stamped.mid);
    claim.sigma_ns = static_cast<double>(stamped.sigma.count());
    claim.T_ecef_head = stamped.T_ecef_head;
    claim.has_image = stamped.has_image;
    scorer_.add(claim);
  }
}

}  // namespace hueline::apps
