#pragma once

#include <string>

#include "calibration/mount/resection.hpp"
#include "core/calibration_record.hpp"

/// What people and programs read of a lens's place.
namespace hueline::calibration {

/// A rigid transform as a mapping of a rig file (docs/rig.md), "key:" and what is in it, each line after `indent`
/// blanks.
std::string mounting_yaml(const std::string& key, const Eigen::Quaterniond& rotation,
                          const Eigen::Vector3d& translation_m, const CalibrationRecord& record, int indent);

/// Turn about the lens's own axes in degrees, centre in metres along the axes of the frame that R_frame_scanner leads
/// to.
CalibrationRecord mount_record(const Eigen::Matrix<double, 6, 6>& covariance, const Eigen::Matrix3d& R_frame_scanner,
                               const std::string& date, const std::vector<std::string>& data, double residual_rms_px);

/// Of one lens: pose, sigma, residual of each point.
std::string resection_json(const std::string& lens, const std::vector<Correspondence>& points,
                           const Resection& resection);

}  // namespace hueline::calibration
