#include "sim/rig_truth.hpp"

#include <cmath>

#include "sim/own_vehicle.hpp"

namespace hueline::sim {

RigTruth rig_truth(const Scenario& c) {
  RigTruth rig;
  rig.T_body_head = c.camera.mount.T_body_sensor();
  const HeadDriftConfig& drift = c.camera.drift;
  rig.T_body_drifted_head = {
      rig.T_body_head.R * rotation_zyx(radians(drift.rot_x_deg), radians(drift.rot_y_deg), radians(drift.rot_z_deg)),
      rig.T_body_head.p};
  rig.drifts_gps_ns = c.sensors_begin_gps_ns() + std::llround(drift.at_s * 1e9);
  rig.T_body_scanner = c.laser.mount.T_body_sensor();
  rig.stack_columns = c.camera.stack_columns;
  rig.stack_rows = c.camera.stack_rows;
  for (std::size_t i = 0; i < c.camera.lenses.size(); ++i)
    rig.lenses.push_back(
        true_lens(c.camera.lenses[i], i, c.camera.lens_model, c.camera.lens_width, c.camera.lens_height));
  return rig;
}

std::vector<std::uint8_t> RigTruth::own_vehicle_mask(std::size_t index) const {
  const TrueLens& lens = lenses[index];
  const Pose T_body_lens = T_body_head * lens.T_head_lens;
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height));
  std::size_t i = 0;
  for (int v = 0; v < lens.height; ++v)
    for (int u = 0; u < lens.width; ++u, ++i)
      if (const auto ray = lens.ray(u, v); ray && own_vehicle_on_ray(T_body_lens.p, T_body_lens.R * *ray))
        mask[i] = 255;
  return mask;
}

LaserTiming laser_timing(LaserModel model, bool vertical_offsets) {
  LaserTiming t;
  if (model == LaserModel::Vlp16) {
    // VLP-16 user manual, table of vertical angles and offsets by laser id; 55.296 us from one firing sequence to the
    // next, 2.304 us from one laser to the next.
    static constexpr std::array<int, 16> kElevation{-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15};
    static constexpr std::array<double, 16> kOffsetMm{11.2, -0.7, 9.7, -2.2, 8.1, -3.7, 6.6, -5.1,
                                                      5.1,  -6.6, 3.7, -8.1, 2.2, -9.7, 0.7, -11.2};
    for (std::size_t i = 0; i < 16; ++i)
      t.beams.push_back({radians(kElevation[i]), vertical_offsets ? kOffsetMm[i] * 1e-3 : 0.0,
                         static_cast<std::uint16_t>((kElevation[i] + 15) / 2)});
    t.firings_per_block = 2;
    t.firing_period_ns = 55'296;
    t.laser_period_ns = 2'304;
    t.block_step_centideg = 40;
    return t;
  }
  // HDL-32E: 32 lasers from -30.67 to +10.67 deg, 4/3 deg apart, with the lower and the upper half interleaved; the
  // angles are those of the table, rounded to 0.01 deg.
  for (int i = 0; i < 32; ++i) {
    const int ring = i % 2 == 0 ? i / 2 : 16 + i / 2;
    const double elevation_deg = std::round((-92.0 / 3.0 + 4.0 / 3.0 * ring) * 100) / 100;
    t.beams.push_back({radians(elevation_deg), 0.0, static_cast<std::uint16_t>(ring)});
  }
  t.firing_period_ns = 46'080;
  t.laser_period_ns = 1'152;
  t.block_step_centideg = 17;
  return t;
}

ProfileTiming profile_timing(const LaserConfig& laser) {
  return {std::llround(1e12 / laser.points_per_s), std::llround(4294967296.0 * laser.lines_per_s / laser.points_per_s)};
}

}  // namespace hueline::sim
