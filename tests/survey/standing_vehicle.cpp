#include "tests/survey/standing_vehicle.hpp"

#include <cmath>
#include <numbers>

#include "fusion/camera_model.hpp"

namespace hueline::test {
namespace {
constexpr double kDeg = std::numbers::pi / 180;
}

StandingVehicle::StandingVehicle() {
  rig.lasers[0].T_body_scanner = {Eigen::Quaterniond::Identity(), rig.head.T_body_head.translation};
}

LaserReturn StandingVehicle::seen_at(double azimuth_deg, double elevation_deg, double range_m, int channel,
                                     std::int32_t offset_ns) const {
  const double a = azimuth_deg * kDeg, e = elevation_deg * kDeg;
  LaserReturn out;
  out.x = static_cast<float>(range_m * std::cos(e) * std::sin(a));
  out.y = static_cast<float>(range_m * std::cos(e) * std::cos(a));
  out.z = static_cast<float>(range_m * std::sin(e));
  out.range_m = static_cast<float>(range_m);
  out.channel = static_cast<std::uint16_t>(channel);
  out.time_offset_ns = offset_ns;
  return out;
}

Image StandingVehicle::image(
    const std::function<double(double azimuth_deg, double elevation_deg, int channel)>& colour) const {
  std::vector<fusion::CameraModel> models;
  for (const fusion::LensMount& lens : rig.head.lenses) models.emplace_back(lens.intrinsics);
  return make_image(306, 6 * 256, PixelFormat::Rgb8, [&](std::uint32_t x, std::uint32_t y, int channel) {
    const std::size_t lens = y / 256;
    const auto direction = models[lens].unproject({static_cast<double>(x), static_cast<double>(y % 256)});
    if (!direction) return 0.0;
    const Eigen::Vector3d d =
        rig.head.T_body_head.rotation * (rig.head.lenses[lens].T_head_lens.rotation * direction->xyz);
    return colour(std::atan2(d.x(), d.y()) / kDeg, std::asin(d.z()) / kDeg, channel);
  });
}

void StandingVehicle::feed(runtime::ProductSink& sink, const std::vector<StampedLaserBatch>& batches,
                           const std::vector<Exposure>& exposures, double until) const {
  fusion::Trajectory trajectory({});
  for (int i = -10; i <= static_cast<int>(until * 100) + 10; ++i) trajectory.add(drive.solution(i * 0.01));
  for (int i = -10; i < 0; ++i) sink.on_solution(drive.solution(i * 0.01));
  auto batch = batches.begin();
  auto exposure = exposures.begin();
  for (int i = 0; i <= static_cast<int>(until * 100); ++i) {
    const GpsTime now = at(i * 0.01);
    sink.on_solution(drive.solution(i * 0.01));
    for (; exposure != exposures.end() && exposure->exposure_mid < now; ++exposure) {
      sink.on_exposure(*exposure);
      Exposure without = *exposure;
      without.image = {};
      sink.on_settled_exposure(without, trajectory);
    }
    for (; batch != batches.end() && batch->time < now; ++batch) {
      sink.on_laser(*batch);
      if (sink.wants_settled_laser()) sink.on_settled_laser(*batch, trajectory);
    }
    sink.on_watermark(now);
  }
}

}  // namespace hueline::test
