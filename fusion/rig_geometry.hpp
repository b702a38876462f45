#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/fault.hpp"
#include "fusion/camera_model.hpp"

/// Where everything sits on the vehicle and what each lens looks like. Filled by config/ from the rig file; SI and rad.
namespace hueline::fusion {

/// A laser scanner on the vehicle.
struct LaserMount {
  SensorId sensor{};
  Transform<Body, Scanner> T_body_scanner;
  double sigma_range_m = 0.02;  ///< one sigma of a range, m

  void visit(Keys& keys);
  KeyError validate() const;
};

/// A closed polygon in pixels; the last corner joins the first. Even-odd rule on pixel centres.
using Polygon = std::vector<Eigen::Vector2d>;

/// One lens of a camera head, and where its image lies.
struct LensMount {
  std::string name;
  Transform<CameraHead, Lens> T_head_lens;
  CameraIntrinsics intrinsics;
  std::string camera_name;                   ///< as files name the camera ...
  SensorId camera{};                         ///< ... whose image holds the lens image
  std::uint32_t x_offset = 0, y_offset = 0;  ///< of the lens image's first pixel in that image, px
  std::vector<Polygon> masks;                ///< in lens pixels: parts of the vehicle, dirt; never a colour from inside

  void visit(Keys& keys);
  KeyError validate() const;
};

/// The panorama that the sphere method speaks of. Pixel centres at whole numbers.
struct PanoramaShape {
  std::uint32_t width = 8000,
                height = 4000;           ///< px; the sphere of docs/methods equation 4 has the radius width / (2 pi) px
  std::optional<double> forward_column;  ///< column of the head's +x direction; none: the middle
  bool is_clockwise = true;          ///< columns grow clockwise seen from above, as when one looks around from inside
  double stitching_radius_m = 20.0;  ///< radius of the sphere on which the stitcher joined the lens images

  double forward() const { return forward_column.value_or((width - 1) / 2.0); }
  void visit(Keys& keys);
  KeyError validate() const;
};

/// A rigid head with one or more lenses, delivered as one stacked image or as one image a camera.
struct CameraHeadGeometry {
  Transform<Body, CameraHead> T_body_head;
  std::vector<LensMount> lenses;
  PanoramaShape panorama;
  std::vector<Polygon>
      panorama_masks;  ///< in panorama pixels (the vehicle's rectangle at the bottom); sphere method only
  /// rad, half-angle of the cap around the head's -z that no exposure is asked for (docs/methods equation 9); 0: none.
  double nadir_half_angle = 0.0;

  void visit(Keys& keys);
  KeyError validate() const;
};

struct RigGeometry {
  std::vector<LaserMount> lasers;
  CameraHeadGeometry head;
  /// Empty when fine, else a sentence that names the key and its allowed range.
  std::string validate() const;
};

}  // namespace hueline::fusion
