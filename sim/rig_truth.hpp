#pragma once

#include <cstdint>
#include <vector>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// True geometry of the simulated sensors: what a perfect calibration would find. Frames: Body x right, y forward, z
/// up; head x forward, y left, z up; scanner x right, y forward (azimuth 0), z up the spin axis.
struct RigTruth {
  Pose T_body_head, T_body_scanner;
  std::vector<TrueLens> lenses;
  int stack_columns = 1, stack_rows = 1;

  int image_width() const { return lenses.empty() ? 0 : lenses[0].width * stack_columns; }
  int image_height() const { return lenses.empty() ? 0 : lenses[0].height * stack_rows; }
  /// First pixel of a lens in the stacked image.
  int column_of(std::size_t lens) const { return static_cast<int>(lens) % stack_columns * lenses[lens].width; }
  int row_of(std::size_t lens) const { return static_cast<int>(lens) / stack_columns * lenses[lens].height; }

  /// 255 where a lens's pixel shows the own vehicle, else 0; row by row, width x height of the lens.
  std::vector<std::uint8_t> own_vehicle_mask(std::size_t lens) const;
};

RigTruth rig_truth(const Scenario& scenario);

/// One laser of a scanner.
struct LaserBeam {
  double elevation = 0;          ///< rad
  double vertical_offset_m = 0;  ///< of its start along the spin axis
  std::uint16_t channel = 0;     ///< ring from the lowest elevation
};
/// In the maker's laser order, with the firing times of its manual.
struct LaserTiming {
  std::vector<LaserBeam> beams;
  int firings_per_block = 1;          ///< firing sequences in a block of 32 channels: 2 for VLP-16
  std::int64_t firing_period_ns = 0;  ///< from one firing sequence to the next
  std::int64_t laser_period_ns = 0;   ///< from one laser to the next
  int block_step_centideg = 0;        ///< turn of a block at the default rate
  std::int64_t block_period_ns() const { return firing_period_ns * firings_per_block; }
  std::int64_t packet_period_ns() const { return 12 * block_period_ns(); }
};
/// Of a Velodyne.
LaserTiming laser_timing(LaserModel model, bool vertical_offsets);

/// When a profile scanner fires, and where its mirror is then: whole numbers of what its wire carries.
struct ProfileTiming {
  std::int64_t pulse_period_ps = 0;
  std::int64_t angle_step = 0;  ///< 2^-32 turn from pulse to pulse
  /// Of pulse `index` after the first of the drive, rounded.
  std::int64_t pulse_ns(std::int64_t index) const { return (index * pulse_period_ps + 500) / 1000; }
  /// Turns so far, in 2^-32: line above 2^32, angle below.
  std::uint64_t turned(std::int64_t index) const {
    return static_cast<std::uint64_t>(index) * static_cast<std::uint64_t>(angle_step);
  }
};
ProfileTiming profile_timing(const LaserConfig& laser);

}  // namespace hueline::sim
