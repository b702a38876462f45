#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/camera_model.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/pixel_mask.hpp"
#include "fusion/pixel_sampler.hpp"

/// Pictures of single lenses, for programs that reconstruct from images.
namespace hueline::products {

/// What happens to the distortion of a lens.
enum class LensPixels : std::uint8_t {
  Recorded,  ///< pixels as the lens made them
  Pinhole,   ///< undistorted: straight edges are straight, and every pixel has a source
};

/// Cuts the picture of one lens out of the image of its camera. Bayer mosaics become RGB as the colouring samples them
/// (fusion/pixel_sampler.hpp); brightness and colours stay as the camera delivered them. Immutable and thread-safe.
class LensPicture {
 public:
  /// `mount` as fusion::CameraHeadGeometry::validate() allows it.
  LensPicture(const fusion::LensMount& mount, LensPixels pixels);

  /// Size, model and numbers of the picture. With LensPixels::Pinhole the model is Brown without distortion; the focal
  /// lengths are those of the lens, so the resolution in the middle stays, and the picture is the largest rectangle
  /// around the principal point that the lens fills, up to 70 degrees from the axis.
  const fusion::CameraIntrinsics& intrinsics() const { return intrinsics_; }
  /// Returns the pixel that shows a point; pixel centres have whole numbers. Empty outside the picture and where the
  /// vehicle hides it (LensMount::masks), and farther than 87 degrees from the axis: programs for reconstruction take
  /// what lies behind a lens for an error.
  std::optional<Eigen::Vector2d> pixel(const Point<Lens>& p_lens) const;
  /// Returns the pixels row by row, three bytes each; none if the camera's image is too small for the lens.
  std::vector<std::uint8_t> render(const fusion::RawView& image) const;

 private:
  fusion::LensMount mount_;
  fusion::CameraIntrinsics intrinsics_;
  fusion::CameraModel recorded_, shown_;  // of the lens image and of the picture
  fusion::PixelMask mask_;
  std::optional<fusion::FloatLens> source_;  // of the pixels of a pinhole; in the lens's own frame
};

/// The lens of a picture in the words of COLMAP (colmap.github.io/cameras.html). There the first pixel covers [0, 1),
/// so its centre is (0.5, 0.5).
struct ColmapCamera {
  std::string model;
  std::vector<double> parameters;
};
/// Returns the model with the same formulas: PINHOLE, OPENCV, FULL_OPENCV (if k3 is not 0) or OPENCV_FISHEYE.
ColmapCamera colmap_camera(const fusion::CameraIntrinsics& intrinsics);

}  // namespace hueline::products
