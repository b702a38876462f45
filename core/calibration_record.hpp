#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"

namespace hueline {

/// Where a calibrated value comes from: stands beside it in the rig file and, with the rig, in every recording. Written
/// by the calibration tools, read by config/, never used in fusion.
struct CalibrationRecord {
  std::string method;                  ///< "lens", "mount", ...: which tool
  std::string date;                    ///< of the calibration, YYYY-MM-DD
  std::vector<std::string> data;       ///< what it was made of: files, recordings, counts
  std::optional<double> residual_rms;  ///< root mean square of what the adjustment left, in `residual_unit`; empty: the
                                       ///< method has no such figure
  std::string residual_unit;           ///< "px", "m", ...; empty without `residual_rms`
  std::vector<std::string> parameters;  ///< names with units, in the order of `sigma`: "focal_x_px", "rotation_x_deg"
  std::vector<double> sigma;            ///< one standard deviation of each
  std::vector<double> covariance;       ///< upper triangle by rows, n (n + 1) / 2 numbers; empty: none

  void visit(Keys& keys);
  KeyError validate() const;
  /// The mapping's lines as YAML, each after `indent` blanks: "calibration:" and what is in it.
  std::string yaml(int indent) const;
};

}  // namespace hueline
