#pragma once

#include <optional>
#include <string>

#include "drivers/beam_angles.hpp"
#include "drivers/hesai/hesai_model.hpp"

/// Hesai's calibration files (beam_angles.hpp) beside captures.
namespace hueline::drivers {

/// Returns the calibration that lies in the folder of the capture file `path` and whose name says that it is one of
/// this model. Nothing: there is none, or there are several, of which none can be chosen.
std::optional<BeamAngles> find_hesai_angles(const std::string& path, const HesaiTable& table);

}  // namespace hueline::drivers
