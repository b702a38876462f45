#include "survey/drive_shots.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "runtime/lens_image.hpp"
#include "runtime/lens_values.hpp"
#include "survey/latest_exposure.hpp"

namespace hueline::survey {

using namespace calibration;

namespace {

constexpr double kRing_deg = 0.6;          // a Velodyne's rings lie 1.3 and 2 degrees apart
constexpr nanoseconds kPart{110'000'000};  // one revolution, so that nothing is held against itself
constexpr nanoseconds kStep{10'000'000};
constexpr std::size_t kFewestSamples = 100;

}  // namespace

DriveShots::DriveShots(const config::Rig& rig, const Config& config)
    : rig_(rig), config_(config), every_(std::max(1, config.every)) {}

void DriveShots::on_settled_laser(const StampedLaserBatch& batch, const fusion::Trajectory& trajectory) {
  const GpsTime now = batch.time;
  if (const auto [pose, reason] = trajectory.pose_at(now); pose) {
    // Two scanners' packets may overtake each other.
    auto after = batches_.end();
    while (after != batches_.begin() && std::prev(after)->batch.time > now) --after;
    batches_.insert(after, {batch, *pose});
  }
  while (!batches_.empty() && batches_.front().batch.time < now - kLatestExposure - config_.reach) batches_.pop_front();
  while (!waiting_.empty() && waiting_.front().is_settled && waiting_.front().mid + config_.reach + kPart < now) {
    decide(waiting_.front());
    waiting_.pop_front();
  }
}

void DriveShots::on_exposure(const Exposure& exposure) {
  if (exposure.timing == ExposureTiming::Unmatched || !exposure.image.is_complete) return;
  if (seen_[exposure.camera]++ % static_cast<std::size_t>(every_) != 0) return;
  Waiting waiting;
  waiting.exposure = exposure.index;
  waiting.mid = exposure.exposure_mid;
  for (std::size_t i = 0; i < rig_.geometry.head.lenses.size(); ++i) {
    const auto& lens = rig_.geometry.head.lenses[i];
    if (lens.camera != exposure.camera) continue;
    GreyImage image = runtime::grey_lens_image(exposure.image, lens, cell_of(lens));
    if (!image.pixels.empty()) waiting.images.emplace_back(i, std::move(image));
  }
  waiting_.push_back(std::move(waiting));
}

void DriveShots::on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  const auto waiting = std::find_if(waiting_.begin(), waiting_.end(),
                                    [&](const Waiting& one) { return one.exposure == exposure.index; });
  if (waiting == waiting_.end()) return;
  waiting->is_settled = true;
  waiting->here = trajectory.pose_at(waiting->mid).pose;
  waiting->before = trajectory.pose_at(waiting->mid - kStep).pose;
  waiting->after = trajectory.pose_at(waiting->mid + kStep).pose;
}

int DriveShots::cell_of(const fusion::LensMount& lens) const { return runtime::cell_for(lens, config_.most_width); }

std::vector<AlignmentLens> DriveShots::lenses() const {
  std::vector<AlignmentLens> out;
  for (const auto& lens : rig_.geometry.head.lenses) out.push_back(runtime::alignment_lens(lens, cell_of(lens)));
  return out;
}

std::vector<LaserSample> DriveShots::samples_around(GpsTime mid, const Transform<Body, Enu>& T_body_enu) const {
  std::vector<LaserSample> out;
  std::vector<float> raw;
  for (const auto& mount : rig_.geometry.lasers) {
    for (GpsTime from = mid - config_.reach; from < mid + config_.reach; from += kPart) {
      std::vector<Eigen::Vector3f> points, bodies;
      std::vector<float> intensity, apart;
      auto placed = std::lower_bound(batches_.begin(), batches_.end(), from,
                                     [](const Placed& one, GpsTime time) { return one.batch.time < time; });
      for (; placed != batches_.end() && placed->batch.time < from + kPart; ++placed) {
        const auto& [batch, pose] = *placed;
        if (batch.sensor != mount.sensor) continue;
        // A packet lasts a millisecond: its middle return's motion is the velocity's.
        const auto T = T_body_enu * pose.T_enu_body * mount.T_body_scanner;
        const Eigen::Vector3d drift = T_body_enu.rotation * pose.velocity_enu;
        for (const LaserReturn& r : batch.returns) {
          points.emplace_back(r.x, r.y, r.z);
          intensity.push_back(static_cast<float>(r.reflectivity));
          apart.push_back(static_cast<float>(to_seconds(batch.time - mid)));
          bodies.push_back(
              ((T * Point<Scanner>{{r.x, r.y, r.z}}).xyz + drift * (r.time_offset_ns * 1e-9)).cast<float>());
        }
      }
      auto part = laser_samples(points, intensity, kRing_deg);
      for (std::size_t i = 0; i < part.size(); ++i) {
        part[i].p_body = bodies[i];
        part[i].apart_s = apart[i];
      }
      out.insert(out.end(), part.begin(), part.end());
      raw.insert(raw.end(), intensity.begin(), intensity.end());
    }
  }
  // Ranks of each revolution alone would not be the same from one to the next.
  const std::vector<float> ranked = ranks(raw);
  for (std::size_t i = 0; i < out.size(); ++i) out[i].intensity = ranked[i];
  const std::size_t outlines = static_cast<std::size_t>(
      std::count_if(out.begin(), out.end(), [](const LaserSample& s) { return s.outline > 0; }));
  if (out.size() > config_.most_samples) {
    const double share = static_cast<double>(config_.most_samples - std::min(outlines, config_.most_samples)) /
                         static_cast<double>(out.size() - outlines);
    double due = 0;
    std::erase_if(out, [&](const LaserSample& s) {
      if (s.outline > 0) return false;
      due += share;
      if (due < 1) return true;
      due -= 1;
      return false;
    });
  }
  return out;
}

void DriveShots::decide(const Waiting& exposure) {
  const auto& [here, before, after] = std::tie(exposure.here, exposure.before, exposure.after);
  if (!here || !before || !after || here->velocity_enu.norm() < config_.least_speed) return;
  const auto T_body_enu = here->T_enu_body.inverse();
  const auto samples = std::make_shared<const std::vector<LaserSample>>(samples_around(exposure.mid, T_body_enu));
  if (samples->size() < kFewestSamples) return;
  const Eigen::AngleAxisd turn(before->T_enu_body.rotation.conjugate() * after->T_enu_body.rotation);
  const double angle = std::remainder(turn.angle(), 2 * std::numbers::pi);
  std::vector<AlignmentShot> shots;
  for (const auto& [lens, image] : exposure.images) {
    AlignmentShot shot;
    shot.lens = lens;
    shot.image = image;
    shot.samples = samples;
    shot.velocity_body = T_body_enu.rotation * here->velocity_enu;
    shot.turn_rate_body = turn.axis() * (angle / (2 * to_seconds(kStep)));
    shots.push_back(std::move(shot));
  }
  kept_.push_back(std::move(shots));
  if (kept_.size() > config_.most_exposures) thin();
}

void DriveShots::thin() {
  // Of several cameras in turn, pairs of whole turns: no camera is given up.
  const std::size_t cameras = std::max<std::size_t>(1, seen_.size());
  std::vector<std::vector<AlignmentShot>> left;
  for (std::size_t i = 0; i < kept_.size(); ++i)
    if (i / cameras % 2 == 0) left.push_back(std::move(kept_[i]));
  kept_ = std::move(left);
  every_ *= 2;
}

std::vector<AlignmentShot> DriveShots::shots() {
  for (const Waiting& exposure : waiting_) decide(exposure);
  waiting_.clear();
  std::vector<AlignmentShot> out;
  for (auto& shots : kept_)
    for (AlignmentShot& shot : shots) out.push_back(std::move(shot));
  kept_count_ = kept_.size();
  kept_.clear();
  return out;
}

}  // namespace hueline::survey
