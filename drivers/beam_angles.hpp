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

/// Reads a calibration file. Errors: Unsupported (the file is no such text), Malformed (with the line), Io.
Result<BeamAngles> read_beam_angles(const std::string& path);

}  // namespace hueline::drivers
