#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"

namespace hueline {

/// Says where a calibrated value comes from. The record stands beside the value in the rig file and, with the rig, in
/// every recording. The calibration tools write it and config/ reads it; fusion never uses it.
struct CalibrationRecord {
  std::string method;             ///< the tool: "lens", "mount", ...
  std::string date;               ///< date of the calibration, YYYY-MM-DD
  std::vector<std::string> data;  ///< what the calibration used: files, recordings, counts
  /// Root mean square of the adjustment's residuals, in `residual_unit`; nothing if the method has no such figure.
  std::optional<double> residual_rms;
  std::string residual_unit;  ///< "px", "m", ...; empty without `residual_rms`
  /// Names of the parameters with their units, in the order of `sigma`: "focal_x_px", "rotation_x_deg".
  std::vector<std::string> parameters;
  std::vector<double> sigma;       ///< one sigma of each parameter
  std::vector<double> covariance;  ///< upper triangle by rows, n (n + 1) / 2 numbers; may be empty

  void visit(Keys& keys);
  KeyError validate() const;
  /// Returns the record as YAML: the line "calibration:" and what belongs to it, each line after `indent` blanks.
  std::string yaml(int indent) const;
};

}  // namespace hueline
