#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/blurred_image.hpp"
#include "calibration/mount/fast_lens.hpp"

namespace hueline::calibration {

/// Normal equations of the four parameters of HeadCorrection, from one shot or summed over many.
struct HeadNormals {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  std::size_t patches = 0, samples = 0;
  double squares = 0;  ///< weighted sum of squared residuals

  HeadNormals& operator+=(const HeadNormals& other);
};

/// The relation between laser intensity and grey level in small patches of the images: intensity = a + b grey. Each
/// patch of each image has its own a and b, so that gain, exposure, vignetting, sunlight and the colour of the surface
/// cancel. Patches without such a relation have no weight. Samples that are hidden from the lens by something nearer
/// are left out. All const functions are pure.
class IntensityRelation {
 public:
  /// Selects the samples that are in the images, or within `margin_deg` of them. `lenses` and `shots` must outlive this
  /// object.
  IntensityRelation(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                    const Transform<Body, CameraHead>& T_body_head, double margin_deg);

  std::size_t shots() const { return visible_.size(); }
  /// Returns the normal equations of one shot, linearised at a head and a time offset, with its image as `picture`. The
  /// step that reduces the squares is -information^-1 gradient; its rotation is applied as in
  /// corrected(). Every `stride`-th sample is used.
  HeadNormals normals(std::size_t shot, const BlurredImage& picture, const Transform<Body, CameraHead>& T_body_head,
                      double time_offset_s, std::size_t stride = 1) const;

 private:
  const std::vector<AlignmentLens>& lenses_;
  const std::vector<AlignmentShot>& shots_;
  std::vector<std::vector<std::uint32_t>> visible_;  // samples used of each shot
};

}  // namespace hueline::calibration
