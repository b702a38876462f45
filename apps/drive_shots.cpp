#include "apps/drive_shots.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::apps {

using namespace calibration;

DriveShots::DriveShots(const config::Rig& rig, const Config& config) : rig_(rig), config_(config), trajectory_(rig.colouring.trajectory) {}

void DriveShots::on_laser(const StampedLaserBatch& batch) { batches_.push_back(batch); }

void DriveShots::on_exposure(const Exposure& exposure) {
  if (exposure.timing == ExposureTiming::Unmatched || !exposure.image.is_complete) return;
  if (seen_++ % static_cast<std::size_t>(std::max(1, config_.every)) == 0 && exposures_.size() < config_.most_exposures) exposures_.push_back(exposure);
}

GreyImage DriveShots::lens_image(const Exposure& exposure, const fusion::LensMount& lens) const {
  const Image& image = exposure.image;
  GreyImage out;
  const auto w = static_cast<std::size_t>(lens.intrinsics.width), h = static_cast<std::size_t>(lens.intrinsics.height);
  if (lens.x_offset + w > image.width || lens.y_offset + h > image.height) return out;
  out.width = static_cast<int>(w);
  out.height = static_cast<int>(h);
  out.pixels.resize(w * h);
  const auto* pixels = reinterpret_cast<const std::uint8_t*>(image.pixels().data());
  const auto at = [&](std::size_t x, std::size_t y) -> int { return pixels[(lens.y_offset + y) * image.stride + lens.x_offset + x]; };
  for (std::size_t y = 0; y < h; ++y)
    for (std::size_t x = 0; x < w; ++x) {
      int value;
      if (image.format == PixelFormat::Rgb8) {
        const std::uint8_t* p = pixels + (lens.y_offset + y) * image.stride + 3 * (lens.x_offset + x);
        value = (p[0] + 2 * p[1] + p[2]) / 4;
      } else if (image.format == PixelFormat::Mono8) {
        value = at(x, y);
      } else {
        // Weights 1 2 1 in both directions take (R + 2 G + B) / 4 out of a Bayer mosaic wherever they stand.
        const std::size_t l = x ? x - 1 : 1, r = x + 1 < w ? x + 1 : w - 2, u = y ? y - 1 : 1, d = y + 1 < h ? y + 1 : h - 2;
        value = (at(l, u) + at(r, u) + at(l, d) + at(r, d) + 2 * (at(x, u) + at(x, d) + at(l, y) + at(r, y)) + 4 * at(x, y)) / 16;
      }
      out.pixels[y * w + x] = static_cast<std::uint8_t>(value);
    }
  return out;
}

std::vector<AlignmentShot> DriveShots::shots() const {
  constexpr double kRing_deg = 0.6;  // a Velodyne's rings lie 1.3 and 2 degrees apart
  constexpr nanoseconds kStep{10'000'000};
  constexpr std::size_t kFewestSamples = 100;
  std::vector<AlignmentShot> out;
  for (const Exposure& exposure : exposures_) {
    const auto here = trajectory_.pose_at(exposure.exposure_mid), before = trajectory_.pose_at(exposure.exposure_mid - kStep),
               after = trajectory_.pose_at(exposure.exposure_mid + kStep);
    if (!here.pose || !before.pose || !after.pose || here.pose->velocity_enu.norm() < config_.least_speed) continue;
    const auto T_body_enu = here.pose->T_enu_body.inverse();
    // Neighbours are looked for within half of the time: one revolution, so that nothing is held against itself.
    std::vector<LaserSample> samples;
    for (const auto& mount : rig_.geometry.lasers) {
      for (int part = 0; part < 2; ++part) {
        const GpsTime from = exposure.exposure_mid - config_.reach + part * config_.reach, to = from + config_.reach;
        std::vector<Eigen::Vector3f> points;
        std::vector<float> intensity;
        std::vector<Eigen::Vector3f> bodies;
        for (const StampedLaserBatch& batch : batches_) {
          if (batch.sensor != mount.sensor || batch.time < from || batch.time >= to) continue;
          const auto pose = trajectory_.pose_at(batch.time);
          if (!pose.pose) continue;
          // A packet lasts a millisecond: its middle return's motion is the velocity's.
          const auto T = T_body_enu * pose.pose->T_enu_body * mount.T_body_scanner;
          const Eigen::Vector3d drift = T_body_enu.rotation * pose.pose->velocity_enu;
          for (const LaserReturn& r : batch.returns) {
            points.emplace_back(r.x, r.y, r.z);
            intensity.push_back(static_cast<float>(r.reflectivity));
            bodies.push_back(((T * Point<Scanner>{{r.x, r.y, r.z}}).xyz + drift * (r.time_offset_ns * 1e-9)).cast<float>());
          }
        }
        auto part_samples = laser_samples(points, intensity, kRing_deg);
        for (std::size_t i = 0; i < part_samples.size(); ++i) part_samples[i].p_body = bodies[i];
        samples.insert(samples.end(), part_samples.begin(), part_samples.end());
      }
    }
    if (samples.size() < kFewestSamples) continue;
    const Eigen::AngleAxisd turn(before.pose->T_enu_body.rotation.conjugate() * after.pose->T_enu_body.rotation);
    const double angle = std::remainder(turn.angle(), 2 * 3.14159265358979323846);
    for (std::size_t i = 0; i < rig_.geometry.head.lenses.size(); ++i) {
      const auto& lens = rig_.geometry.head.lenses[i];
      if (lens.camera != exposure.camera) continue;
      AlignmentShot shot;
      shot.lens = i;
      shot.image = lens_image(exposure, lens);
      if (shot.image.pixels.empty()) continue;
      shot.samples = samples;
      shot.velocity_body = T_body_enu.rotation * here.pose->velocity_enu;
      shot.turn_rate_body = turn.axis() * (angle / (2 * to_seconds(kStep)));
      out.push_back(std::move(shot));
    }
  }
  return out;
}

}  // namespace hueline::apps
