#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/fault.hpp"
#include "core/time.hpp"
#include "fusion/camera_model.hpp"

/// Where the sensors sit on the vehicle and what each lens looks like, in SI units and rad. config/ fills it from the
/// rig file.
namespace hueline::fusion {

/// A laser scanner on the vehicle.
struct LaserMount {
  SensorId sensor{};
  Transform<Body, Scanner> T_body_scanner;
  double sigma_range_m = 0.02;  ///< one sigma of a range

  void visit(Keys& keys);
  KeyError validate() const;
};

/// A closed polygon in pixels; the last corner is joined to the first. A pixel is inside by the even-odd rule for its
/// centre.
using Polygon = std::vector<Eigen::Vector2d>;

/// The most lenses of a head: each has a bit in 32.
constexpr std::size_t kMostLenses = 32;

/// One lens of a camera head, and the place of its image.
struct LensMount {
  std::string name;
  Transform<CameraHead, Lens> T_head_lens;
  CameraIntrinsics intrinsics;
  std::string camera_name;                   ///< the camera whose image contains the lens image, as files name it
  SensorId camera{};                         ///< the same camera
  std::uint32_t x_offset = 0, y_offset = 0;  ///< place of the lens image's first pixel in the camera's image, px
  /// Time from one row of the lens image to the next, if rows are exposed one after the other; negative if the last row
  /// is the first. An exposure's time is that of the middle row.
  nanoseconds row_time{0};
  /// In lens pixels: parts of the vehicle, dirt. Pixels inside give no colour.
  std::vector<Polygon> masks;

  void visit(Keys& keys);
  KeyError validate() const;
};

/// The panorama of the panorama method. Pixel centres have whole numbers.
struct PanoramaShape {
  std::uint32_t width = 8000,
                height = 4000;  ///< px; the sphere of docs/methods, equation 4, has the radius width / (2 pi) px
  std::optional<double> forward_column;  ///< column of the head's +x direction; nothing: the middle
  bool is_clockwise = true;          ///< columns run clockwise seen from above, as for a viewer inside who turns right
  double stitching_radius_m = 20.0;  ///< radius of the sphere on which the stitcher joined the lens images

  double forward() const { return forward_column.value_or((width - 1) / 2.0); }
  void visit(Keys& keys);
  KeyError validate() const;
};

/// A rigid head with one or more lenses. It delivers one stacked image, or one image for each camera.
struct CameraHeadGeometry {
  Transform<Body, CameraHead> T_body_head;
  std::vector<LensMount> lenses;
  PanoramaShape panorama;
  /// In panorama pixels: the vehicle's rectangle at the bottom. Used by the panorama method only.
  std::vector<Polygon> panorama_masks;
  /// Half-angle of the cap around the head's -z in which no exposure is used, rad (docs/methods, equation 9); 0: no
  /// cap.
  double nadir_half_angle = 0.0;

  void visit(Keys& keys);
  KeyError validate() const;
};

/// All scanners and the camera head of a vehicle.
struct RigGeometry {
  std::vector<LaserMount> lasers;
  CameraHeadGeometry head;
  /// Returns an empty text if all values are allowed, otherwise a sentence that names the key and its allowed range.
  std::string validate() const;
};

}  // namespace hueline::fusion
