#pragma once

#include <Eigen/Core>
#include <cmath>

#include "calibration/mount/alignment.hpp"

namespace hueline::calibration {

/// The estimated values: rotation of the head about its own axes (three numbers, rad), and time offset of the images
/// (s).
using HeadCorrection = Eigen::Vector4d;

/// Returns T_body_head with a correction: p_head = exp(-turn) T_head_body p_body. The head is rotated by `turn` about
/// its own axes.
Transform<Body, CameraHead> corrected(const Transform<Body, CameraHead>& start, const HeadCorrection& correction);

/// The projection of a lens in single precision, for millions of points. It is project_with without its checks; pixels
/// are those of the lens image.
struct FastLens {
  LensModel model;
  /// `cosine` is the cosine of the largest angle from the axis that is projected.
  float fx, fy, cx, cy, cosine;
  float k[5];
  Eigen::Matrix3f R_lens_body;
  Eigen::Vector3f t_lens_body;

  /// Computes the pixel of a point of Body. Returns false if the point is not in the field of view.
  bool project(const Eigen::Vector3f& p_body, float& u, float& v) const {
    return project_lens(R_lens_body * p_body + t_lens_body, u, v);
  }
  /// Computes the pixel of a point of the lens frame. Returns false outside the field of view and within 0.3 m of the
  /// lens.
  bool project_lens(const Eigen::Vector3f& p, float& u, float& v) const {
    const float r2 = p.x() * p.x() + p.y() * p.y(), length = std::sqrt(r2 + p.z() * p.z());
    if (!(p.z() > cosine * length) || !(length > 0.3F)) return false;
    if (model == LensModel::Brown) {
      const float a = p.x() / p.z(), b = p.y() / p.z(), s = a * a + b * b;
      const float radial = 1 + s * (k[0] + s * (k[1] + s * k[4]));
      u = fx * (a * radial + 2 * k[2] * a * b + k[3] * (s + 2 * a * a)) + cx;
      v = fy * (b * radial + k[2] * (s + 2 * b * b) + 2 * k[3] * a * b) + cy;
      return true;
    }
    const float across = std::sqrt(r2), angle = std::atan2(across, p.z()), a2 = angle * angle;
    const float scale =
        across > 1e-9F ? angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / across : 1.0F;
    u = fx * p.x() * scale + cx;
    v = fy * p.y() * scale + cy;
    return true;
  }
};

/// Returns a lens whose points are in its own frame.
FastLens fast_lens(const LensValues& values, double max_angle);

/// Returns a lens at one exposure for a head at `T_head_body` and an image that was taken `time_offset_s` later than
/// its time says.
FastLens fast_lens(const AlignmentLens& lens, const Transform<CameraHead, Body>& T_head_body, const AlignmentShot& shot,
                   double time_offset_s);

}  // namespace hueline::calibration
