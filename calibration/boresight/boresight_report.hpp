#pragma once

#include <string>
#include <vector>

#include "calibration/boresight/boresight.hpp"
#include "core/calibration_record.hpp"

/// What people and programs read of a scanner's boresight.
namespace hueline::calibration {

/// Lines for people: planes, then each scanner's six values with sigma and the share of them that comes from the data.
std::string boresight_text(const Boresight& found);

/// Of scanner `scanner`; turns in degrees about Body's axes, lever arm in metres. `data`: what it was made of.
CalibrationRecord boresight_record(const Boresight& found, std::size_t scanner, const std::string& date,
                                   std::vector<std::string> data);

/// Everything, for programs.
std::string boresight_json(const Boresight& found);

}  // namespace hueline::calibration
