#pragma once

#include <optional>
#include <string>

#include "drivers/beam_angles.hpp"
#include "drivers/hesai/hesai_model.hpp"

/// Hesai's calibration files (beam_angles.hpp): whether they are of a model, and those beside captures.
namespace hueline::drivers {

/// Returns, for people, why these are not the directions of a scanner of this model, and of which model they may be.
/// Empty: they can be its own.
std::string why_not_of(const HesaiTable& table, const BeamAngles& angles);

/// Returns the calibration that lies in the folder of the capture file `path` and whose name says that it is one of
/// this model. Nothing: there is none, or there are several, of which none can be chosen.
std::optional<BeamAngles> find_hesai_angles(const std::string& path, const HesaiTable& table);

}  // namespace hueline::drivers
