#pragma once

#include <cstdint>
#include <vector>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// True geometry of the simulated sensors, which a perfect calibration would find. Frames: Body x right, y forward, z
/// up; head x forward, y left, z up; scanner x right, y forward (azimuth 0), z up along the spin axis.
struct RigTruth {
  Pose T_body_head, T_body_scanner;  ///< T_body_head: before a drift, as the rig has it
  Pose T_body_drifted_head;          ///< from `drifts_gps_ns` on
  GpsNs drifts_gps_ns = 0;
  std::vector<TrueLens> lenses;
  int stack_columns = 1, stack_rows = 1;

  /// Returns the pose of the head in Body at a time.
  const Pose& T_body_head_at(GpsNs time) const { return time < drifts_gps_ns ? T_body_head : T_body_drifted_head; }
  int image_width() const { return lenses.empty() ? 0 : lenses[0].width * stack_columns; }
  int image_height() const { return lenses.empty() ? 0 : lenses[0].height * stack_rows; }
  /// Return column and row of the first pixel of a lens in the stacked image.
  int column_of(std::size_t lens) const { return static_cast<int>(lens) % stack_columns * lenses[lens].width; }
  int row_of(std::size_t lens) const { return static_cast<int>(lens) / stack_columns * lenses[lens].height; }

  /// Returns 255 for each pixel of a lens that shows the own vehicle and 0 for the others, row by row, width
  /// x height of the lens.
  std::vector<std::uint8_t> own_vehicle_mask(std::size_t lens) const;
};

/// Returns the true geometry of a scenario's sensors.
RigTruth rig_truth(const Scenario& scenario);

/// One laser of a scanner with several beams.
struct LaserBeam {
  double elevation = 0;          ///< elevation of the beam, rad
  double vertical_offset_m = 0;  ///< where the beam starts along the spin axis
  std::uint16_t channel = 0;     ///< ring, counted from the lowest elevation
};
/// Lasers in the maker's order, and the firing times of the maker's manual.
struct LaserTiming {
  std::vector<LaserBeam> beams;
  int firings_per_block = 1;          ///< firing sequences in a block of 32 channels: 2 for VLP-16, 1 for HDL-32E
  std::int64_t firing_period_ns = 0;  ///< time from one firing sequence to the next
  std::int64_t laser_period_ns = 0;   ///< time from one laser to the next
  int block_step_centideg = 0;        ///< angle from one block to the next at the default rate, hundredths of a degree
  std::int64_t block_period_ns() const { return firing_period_ns * firings_per_block; }
  std::int64_t packet_period_ns() const { return 12 * block_period_ns(); }
};
/// Returns beams and times of a Velodyne. Without `vertical_offsets` all beams start at the optical centre.
LaserTiming laser_timing(LaserModel model, bool vertical_offsets);

/// When a profile scanner fires, and the angle of its mirror then. Both are whole numbers of the units that the wire
/// carries.
struct ProfileTiming {
  std::int64_t pulse_period_ps = 0;
  std::int64_t angle_step = 0;  ///< angle from pulse to pulse, in 2^-32 of a turn
  /// Returns the time of pulse `index` after the first pulse of the drive, rounded to ns.
  std::int64_t pulse_ns(std::int64_t index) const { return (index * pulse_period_ps + 500) / 1000; }
  /// Returns the turn since the first pulse, in 2^-32 of a turn: the line is the part from bit 32 on, the angle the
  /// part below.
  std::uint64_t turned(std::int64_t index) const {
    return static_cast<std::uint64_t>(index) * static_cast<std::uint64_t>(angle_step);
  }
};
/// Returns the timing of a profile scanner with the rates of `laser`.
ProfileTiming profile_timing(const LaserConfig& laser);

}  // namespace hueline::sim
