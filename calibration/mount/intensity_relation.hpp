#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/fast_lens.hpp"

namespace hueline::calibration {

/// Normal equations of the four parameters of HeadCorrection, from one shot or the sum of many.
struct HeadNormals {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  std::size_t patches = 0, samples = 0;
  double squares = 0;  ///< weighted squares of the residuals

  HeadNormals& operator+=(const HeadNormals& other);
};

/// Small patches of the images in which laser intensity follows the grey level: intensity = a + b grey, with an a and a
/// b of its own for each patch of each image, so that gain, exposure, vignetting, sun and the surface's colour fall
/// out. Patches without such a relation weigh nothing. What the lens cannot see, because something nearer in the same
/// direction stands before it, is left out. Pure.
class IntensityRelation {
 public:
  /// Whatever is in the images, or may come into them within `margin_deg`. The arguments must outlive it.
  IntensityRelation(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                    const Transform<Body, CameraHead>& T_body_head, double margin_deg);

  std::size_t shots() const { return visible_.size(); }
  /// Linearised at a head and a time offset, with images blurred by `blur_px`. The step that lowers the squares is
  /// -information^-1 gradient, its turn to be put behind that of `T_body_head`. Every `stride`-th sample is used.
  HeadNormals normals(std::size_t shot, const Transform<Body, CameraHead>& T_body_head, double time_offset_s,
                      float blur_px, std::size_t stride = 1) const;

 private:
  const std::vector<AlignmentLens>& lenses_;
  const std::vector<AlignmentShot>& shots_;
  std::vector<std::vector<std::uint32_t>> visible_;  // samples of each shot
};

}  // namespace hueline::calibration
