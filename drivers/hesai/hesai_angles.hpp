#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/hesai/hesai_model.hpp"

/// Hesai's calibration files: text with a line for each channel, "channel,elevation,azimuth" in degrees, below a line
/// that names the columns.
namespace hueline::drivers {

/// The directions of a scanner's beams, by channel, deg.
struct HesaiAngles {
  std::vector<double> elevations_deg, azimuths_deg;
  std::string file;  ///< from which they were read
};

/// Reads a calibration file. Errors: Unsupported (the file is no such text), Malformed (with the line), Io.
Result<HesaiAngles> read_hesai_angles(const std::string& path);

/// Returns the calibration that lies in the folder of the capture file `path` and whose name says that it is one of
/// this model. Nothing: there is none, or there are several, of which none can be chosen.
std::optional<HesaiAngles> find_hesai_angles(const std::string& path, const HesaiTable& table);

}  // namespace hueline::drivers
