#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "fusion/camera_model.hpp"

/// What one image and one cloud need, read from this project's files and from those that other people publish beside
/// such pairs.
namespace hueline::apps {

/// A lens, and where the laser is seen from it.
struct ShotCalibration {
  std::optional<fusion::CameraIntrinsics> intrinsics;  ///< width and height 0: the file names no size
  std::string lens_file;                               ///< that held the lens
  std::optional<Transform<Lens, Scanner>> T_lens_scanner;
};

/// The files together; a later one outranks an earlier. Told by the ending:
/// .json  SensorsCalibration: an object with one member whose `param` holds cam_K and cam_dist, or sensor_calib;
/// .txt   lines "NAME: numbers": K, D and T (rows of lens from laser), or KITTI's P2 with Tr_velo_to_cam (and R0_rect)
/// or Tr; other  YAML with `lens:` (as calibrate lens writes it), `T_lens_scanner:`, or both. Throws
/// config::ConfigError with file and key.
ShotCalibration read_shot_calibration(const std::vector<std::string>& paths);

/// What an image of another size than its lens means.
enum class OtherSize {
  Refuse,      ///< a mistake
  SamePixels,  ///< pixel (0, 0) is that of the lens and pixels are as large: the image is cut at its right or lower
               ///< border, or the size beside the lens is wrong
  Scaled,      ///< the whole image of the lens, made smaller or larger
};

/// `lens` for an image of this size. Throws config::ConfigError, which names the sizes, the files and the option, if
/// the sizes differ and `other` is Refuse.
fusion::CameraIntrinsics fit_to_image(const fusion::CameraIntrinsics& lens, const std::string& lens_file, int width,
                                      int height, const std::string& image_file, OtherSize other);

/// The option `--image-size` and its words.
extern const std::vector<std::string> kImageSizeWords;
constexpr const char* kImageSizeHelp =
    "what an image of another size than its lens is: refuse (a mistake), same-pixels (cut at its right or lower "
    "border, or the size beside the lens is wrong), scaled (of the whole image)";
OtherSize other_size(const std::string& word);

}  // namespace hueline::apps
