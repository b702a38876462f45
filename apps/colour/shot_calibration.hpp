#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "fusion/camera_model.hpp"

/// Reads the calibration that one image and one cloud need, from files of this project and from files that others
/// publish beside such data.
namespace hueline::apps {

/// The calibration of a lens, and the pose of the laser relative to it.
struct ShotCalibration {
  std::optional<fusion::CameraIntrinsics> intrinsics;  ///< width and height are 0 if the file gives no size
  std::string lens_file;                               ///< the file that held the lens
  std::string lens_note;  ///< what a user must know of how it was read, a line; mostly empty
  std::optional<Transform<Lens, Scanner>> T_lens_scanner;
  std::string pose_note;  ///< the same of the pose
};

/// Reads all files; a later file overrides an earlier one. The ending of the name decides the format: .json, .txt, or
/// else YAML. docs/colour.md lists what they may hold. Throws InputError with file and key, also if one is not there.
ShotCalibration read_shot_calibration(const std::vector<std::string>& paths);

/// Returns the lens of one file, and prints what a user must know of it. Throws InputError, also if it has none.
fusion::CameraIntrinsics read_lens(const std::string& path);

/// What to do with an image whose size is not that of its lens.
enum class OtherSize {
  Refuse,  ///< report an error
  /// Pixel (0, 0) and the pixel size are those of the lens: the image is cut at its right or lower border, or the size
  /// beside the lens is wrong.
  SamePixels,
  Scaled,  ///< the image shows all that the lens shows, in another number of pixels
};

/// Returns `lens` for an image of this size. Throws config::ConfigError, which names the sizes, the files and the
/// option, if the sizes differ and `other` is Refuse.
fusion::CameraIntrinsics fit_to_image(const fusion::CameraIntrinsics& lens, const std::string& lens_file, int width,
                                      int height, const std::string& image_file, OtherSize other);

/// Which image a lens belongs to, if EXIF data turn the image before it is shown.
enum class ImageTurn {
  Auto,    ///< to the one that has the shape of the lens
  Stored,  ///< to the rows and columns of the file, as `calibrate lens` reads them
  Shown,   ///< to the image as it is shown, as OpenCV's imread gives it to the programs that use it
};
/// The option `--image-turn` and its words.
extern const std::vector<std::string> kImageTurnWords;
constexpr const char* kImageTurnHelp =
    "of a photograph that its EXIF data turn: the lens is that of the image as stored (calibrate lens reads it so), as "
    "shown (OpenCV's imread turns it so), or auto: of the one whose shape the lens has";
/// Returns the meaning of a word of kImageTurnWords.
ImageTurn image_turn(const std::string& word);

/// Returns whether an image of `width` x `height` px, as stored, is to be turned as its EXIF `orientation` shows it, so
/// that it is the image of `lens`; and prints so. Throws config::ConfigError, which names the option, if `turn` is Auto
/// and the lens could belong to both.
bool is_turned(const fusion::CameraIntrinsics& lens, const std::string& lens_file, int width, int height,
               int orientation, const std::string& image_file, ImageTurn turn);

/// The option `--image-size` and its words.
extern const std::vector<std::string> kImageSizeWords;
constexpr const char* kImageSizeHelp =
    "how to treat an image whose size is not that of its lens: refuse (report an error), same-pixels (the image is cut "
    "at its right or lower border, or the size beside the lens is wrong), scaled (the image was made smaller or "
    "larger)";
/// Returns the meaning of a word of kImageSizeWords.
OtherSize other_size(const std::string& word);

}  // namespace hueline::apps
