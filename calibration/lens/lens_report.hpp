#pragma once

#include <string>
#include <vector>

#include "calibration/lens/lens_calibration.hpp"
#include "core/calibration_record.hpp"

/// Texts and files that report a calibrated lens.
namespace hueline::calibration {

/// Facts for the reports that the calibration itself does not have.
struct LensReportContext {
  std::string date;                 ///< YYYY-MM-DD
  std::string data;                 ///< for example "13 of 15 images of DIR"
  std::vector<std::string> unseen;  ///< images in which the board was not found, with the reason
  std::string reference;            ///< result of another program with the same corners; empty if none was run
};

/// Returns the record of the calibration for the rig file.
CalibrationRecord lens_record(const LensCalibration& calibration, const LensReportContext& context);

/// Returns the keys of a lens in a rig file (docs/rig.md): model, size, values and record. Put them in place of the
/// same keys of a lens, or below `lens:` for `hueline colour`. Each line begins with `indent` blanks. `max_angle_deg`
/// is the largest angle from the axis at which corners were seen, plus a tenth.
std::string lens_fragment(const LensCalibration& calibration, const LensReportContext& context, int indent);

/// Returns the whole result as JSON: values, sigmas, covariance, poses, residuals, and what was left out and why.
std::string lens_json(const LensCalibration& calibration, const LensReportContext& context);

/// Returns one HTML page without external links: values with sigmas, residual field, coverage, residual of each view,
/// and what was left out.
std::string lens_html(const LensCalibration& calibration, const LensReportContext& context);

/// Returns the largest angle from the axis at which a corner was used, rad.
double covered_angle(const LensCalibration& calibration);

}  // namespace hueline::calibration
