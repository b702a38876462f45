#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "core/geodesy.hpp"

/// SBET, the file in which programs hand over a trajectory that they have calculated after the drive (Applanix's
/// "smoothed best estimate of trajectory"). It has no header: records of 17 doubles, little endian.
///
///   time (s of the GPS week), latitude, longitude (rad), height above the ellipsoid (m), velocity x, y, z (m/s), roll,
///   pitch, platform heading, wander angle (rad), acceleration x, y, z, angular rate x, y, z
///
/// Velocities are not read: POSPac writes them along the wander frame (x and y are turned from north and west by the
/// wander angle), others along the vehicle, and nothing in the file says which. The positions tell the velocity.
namespace hueline::drivers {

constexpr std::size_t kSbetDoubles = 17, kSbetBytes = kSbetDoubles * sizeof(double);

/// A record of an SBET.
struct SbetRecord {
  double second = 0;  ///< s of the GPS week; may go on beyond the end of the week
  Geodetic position{};
  double roll = 0, pitch = 0;   ///< rad, as in Attitude
  double platform_heading = 0;  ///< rad, clockwise from the x axis of the wander frame
  double wander = 0;            ///< rad; that axis is turned by it from north, counterclockwise
  /// One sigma, in the order of InsSolution::sigma, if something besides the record states it.
  std::optional<std::array<double, 9>> sigma;
};

/// Returns the record of 17 doubles.
SbetRecord sbet_record(std::span<const double> doubles);
/// Returns what cannot be true of 17 doubles as a record, "a latitude of 48 rad"; empty if nothing.
std::string impossible_sbet(std::span<const double> doubles);
/// Returns `second` with the weeks added that ended since `last`, if the file counts from 0 again at their ends.
double continued_second(double second, const std::optional<double>& last);

}  // namespace hueline::drivers
