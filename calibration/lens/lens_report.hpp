#pragma once

#include <string>

#include "calibration/lens/lens_calibration.hpp"
#include "core/calibration_record.hpp"

/// What people and programs read of a calibrated lens.
namespace hueline::calibration {

/// What the caller knows beside the numbers.
struct LensReportContext {
  std::string date;                 ///< YYYY-MM-DD
  std::string data;                 ///< "13 of 15 images of DIR"
  std::vector<std::string> unseen;  ///< images without the board, with the reason
  std::string reference;            ///< what another program makes of the same corners; empty: nothing was asked
};

CalibrationRecord lens_record(const LensCalibration& calibration, const LensReportContext& context);

/// Keys of a lens in a rig file (docs/rig.md): model, size, values, record. Put in place of the same keys of a lens, or
/// below `lens:` for `hueline colour`, each line after `indent` blanks. `max_angle_deg`: as far from the axis as
/// corners were seen, and a tenth more.
std::string lens_fragment(const LensCalibration& calibration, const LensReportContext& context, int indent);

/// Everything: values, sigma, covariance, poses, residuals, what was left out and why.
std::string lens_json(const LensCalibration& calibration, const LensReportContext& context);

/// One page, no links outside: values with sigma, residual field, coverage, residual of each view, what was left out.
std::string lens_html(const LensCalibration& calibration, const LensReportContext& context);

/// Farthest angle from the axis at which a corner was used, rad.
double covered_angle(const LensCalibration& calibration);

}  // namespace hueline::calibration
