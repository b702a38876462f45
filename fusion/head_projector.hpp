#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/measurements.hpp"
#include "fusion/panorama.hpp"
#include "fusion/pixel_mask.hpp"

/// The hot path from a point in the head's frame to the pixel that shows it, in float. Only additions, multiplications,
/// divisions and square roots in the lens models: the same bits whatever mathematics library is there.
namespace hueline::fusion {

enum class ColourMethod : std::uint8_t {
  Lens,      ///< project into the lens that sees the point best, with its distortion (docs/methods equations 11 to 16)
  Panorama,  ///< project onto the panoramic sphere, then to the lens pixel a stitcher put there (docs/methods equations
             ///< 4 to 6)
};

/// Where a point is seen.
struct Sight {
  std::uint8_t lens = 0;
  float x = 0, y = 0;   ///< lens pixel to sample
  float border_px = 0;  ///< distance of that pixel to the lens image's border
};

/// One lens, ready for float arithmetic.
struct FloatLens {
  explicit FloatLens(const LensMount& mount);
  /// Pixel of a point of the head's frame; false beyond the field of view or nearer than kSampleReach to the border.
  bool project(float x, float y, float z, Sight& sight) const;

  std::array<float, 3> axis;         ///< optical axis in the head's frame
  std::array<float, 9> R_lens_head;  ///< row by row
  std::array<float, 3> t_lens_head;
  float focal_x, focal_y, centre_x, centre_y, cosine_limit, last_x, last_y;
  bool is_plane;  ///< Brown
  std::array<float, 5> distortion;
  /// KannalaBrandt: (distorted angle) / sin(angle) as a polynomial in the cosine of the angle, mapped to [-1, 1].
  std::vector<float> series;
  float series_scale = 0, series_shift = 0;
  std::uint8_t index = 0;
  std::size_t camera = 0;  ///< index into HeadProjector::cameras()
  std::uint32_t x_offset, y_offset, width, height;
  PixelMask mask;
  /// Largest difference of project() from CameraModel, px, over a grid of directions.
  double largest_error_px(const CameraModel& model) const;
};

/// All lenses of a head. Immutable, thread-safe.
class HeadProjector {
 public:
  /// `head.validate()` must be empty.
  HeadProjector(const CameraHeadGeometry& head, ColourMethod method);

  /// The lens that sees a point of the head's frame best, outside hole and masks. `has_image[camera]` is false for a
  /// camera whose image is missing: its lenses see nothing; nor does a lens whose bit in `blind` is set. False: nobody
  /// sees it.
  bool see(float x, float y, float z, const std::uint8_t* has_image, std::uint32_t blind, Sight& sight) const;
  /// Bits of the lenses whose pixels lie in a lost part of this camera's image.
  std::uint32_t blind_lenses(SensorId camera, const std::vector<PixelRegion>& lost) const;
  /// Panorama pixel of a point of the head's frame, float.
  void panorama_pixel(float x, float y, float z, float& u, float& v) const;

  const std::vector<FloatLens>& lenses() const { return lenses_; }
  /// The cameras that deliver the lens images, each once, in the order of the lenses.
  const std::vector<SensorId>& cameras() const { return cameras_; }
  ColourMethod method() const { return method_; }

 private:
  bool is_in_hole(float x, float y, float z) const;

  ColourMethod method_;
  PanoramaShape panorama_;
  float stitching_radius_, hole_cosine_;
  PixelMask panorama_mask_;
  std::vector<FloatLens> lenses_;
  std::vector<SensorId> cameras_;
};

}  // namespace hueline::fusion
