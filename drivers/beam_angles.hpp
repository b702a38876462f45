#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"

/// Calibration files of scanners with several beams: text with a line for each channel, "channel,elevation,azimuth" in
/// degrees, below a line that names the columns. Hesai writes such files, and users of RoboSense scanners do.
namespace hueline::drivers {

/// The directions of a scanner's beams, by channel, deg.
struct BeamAngles {
  std::vector<double> elevations_deg, azimuths_deg;
  std::string file;  ///< from which they were read
};

/// The beams of one scanner point elsewhere than its model's nominal directions say, by some tenths of a degree: the
/// calibrations of scanners that were compared are up to 0.17 degrees off. What is farther off is not of this model.
constexpr double kMostOffNominal_deg = 1.5;

/// Compares the directions of one scanner with the nominal ones of a model that has as many beams. Returns, for people,
/// the beam that is farthest off and where it and the model's point, or nothing if all are near enough.
std::string off_nominal(const BeamAngles& given, const BeamAngles& nominal);

/// Reads a calibration file. Errors: Unsupported (the file is no such text), Malformed (with the line), Io.
Result<BeamAngles> read_beam_angles(const std::string& path);

}  // namespace hueline::drivers
