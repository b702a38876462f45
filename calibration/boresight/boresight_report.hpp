#pragma once

#include <string>
#include <vector>

#include "calibration/boresight/boresight.hpp"
#include "core/calibration_record.hpp"

/// Texts and files that report a scanner's boresight.
namespace hueline::calibration {

/// Returns lines for people: the planes, then the six values of each scanner with their sigmas and the share of
/// information that comes from the data.
std::string boresight_text(const Boresight& found);

/// Returns the record of scanner `scanner` for the rig file, with rotations in degrees about Body's axes and the lever
/// arm in metres. `data` names the input.
CalibrationRecord boresight_record(const Boresight& found, std::size_t scanner, const std::string& date,
                                   std::vector<std::string> data);

/// Returns the whole result as JSON.
std::string boresight_json(const Boresight& found);

}  // namespace hueline::calibration
