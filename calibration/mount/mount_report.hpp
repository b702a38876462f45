#pragma once

#include <string>
#include <vector>

#include "calibration/mount/resection.hpp"
#include "core/calibration_record.hpp"

/// Texts and files that report the pose of a lens.
namespace hueline::calibration {

/// Returns a rigid transform as a mapping of a rig file (docs/rig.md): the line "key:" and its content. Each line
/// begins with `indent` blanks.
std::string mounting_yaml(const std::string& key, const Eigen::Quaterniond& rotation,
                          const Eigen::Vector3d& translation_m, const CalibrationRecord& record, int indent);

/// Returns the record of a pose: rotation about the lens's own axes in degrees, centre in metres along the axes of the
/// frame into which R_frame_scanner rotates.
CalibrationRecord mount_record(const Eigen::Matrix<double, 6, 6>& covariance, const Eigen::Matrix3d& R_frame_scanner,
                               const std::string& date, const std::vector<std::string>& data, double residual_rms_px);

/// Returns the resection of one lens as JSON: pose, sigmas and the residual of each point.
std::string resection_json(const std::string& lens, const std::vector<Correspondence>& points,
                           const Resection& resection);

}  // namespace hueline::calibration
