#pragma once

#include <string>
#include <string_view>
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

/// A model, and the directions that the maker's manual has for its beams.
struct ModelAngles {
  std::string_view model;
  BeamAngles nominal;
};

/// Returns the directions of beams that have an elevation_deg and an azimuth_deg.
template <class Beams>
BeamAngles angles_of(const Beams& beams) {
  BeamAngles out;
  for (const auto& beam : beams) {
    out.elevations_deg.push_back(beam.elevation_deg);
    out.azimuths_deg.push_back(beam.azimuth_deg);
  }
  return out;
}

/// Returns, for people, why these are not the directions of a scanner of a model, and which of `all` models they fit.
/// Empty: they can be its own. `other_count` is what is said where the model has another number of beams.
std::string why_not_of(const ModelAngles& model, const std::vector<ModelAngles>& all, const BeamAngles& given,
                       const std::string& other_count);

/// Reads a calibration file. Errors: Unsupported (the file is no such text), Malformed (with the line), Io.
Result<BeamAngles> read_beam_angles(const std::string& path);

}  // namespace hueline::drivers
