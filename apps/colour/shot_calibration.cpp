#include "apps/colour/shot_calibration.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "apps/colour/published_calibration.hpp"
#include "apps/input_error.hpp"
#include "config/key_reader.hpp"
#include "config/section.hpp"
#include "core/exif_orientation.hpp"
#include "core/mounting.hpp"
#include "core/remote_store.hpp"

namespace hueline::apps {
namespace {

/// Reads this project's own form: `lens:` as in a rig, and `T_lens_scanner:` as a mounting; either or both.
void read_own_yaml(const std::string& path, ShotCalibration& out) {
  config::Section root = config::Section::load_file(path);
  if (!root.has("lens") && !root.has("T_lens_scanner"))
    throw config::ConfigError(
        path +
        ": holds no calibration that is read: lens or T_lens_scanner of this program; camera_matrix (ROS, OpenCV), K "
        "(CameraInfo), CameraMat or CameraExtrinsicMat (Autoware), cam0 (Kalibr), projection_parameters (camodocal), "
        "cam_fx or Rcl and Pcl (FAST-LIVO), child_frame_id with transform (TransformStamped)");
  if (root.has("lens")) {
    out.intrinsics = config::read_config<fusion::CameraIntrinsics>(root.section("lens"));
    out.lens_file = path;
  }
  if (root.has("T_lens_scanner"))
    out.T_lens_scanner = config::read_config<Mounting>(root.section("T_lens_scanner")).transform<Lens, Scanner>();
  root.finish();
}

CalibrationParts read_file(const std::string& path) {
  CalibrationParts out;
  if (path.ends_with(".json")) {
    read_published_json(path, out);
  } else if (path.ends_with(".txt")) {
    read_published_text(path, out);
  } else if (!read_published_yaml(path, out)) {
    read_own_yaml(path, out.shot);
  }
  return out;
}

}  // namespace

ShotCalibration read_shot_calibration(const std::vector<std::string>& paths) {
  CalibrationParts out;
  for (const auto& path : paths) {
    if (!is_address(path) && !std::filesystem::exists(path)) throw InputError("open " + path + ": is not there");
    const CalibrationParts one = [&] {
      try {
        return read_file(path);
      } catch (const config::ConfigError& e) {
        throw InputError(e.what());
      }
    }();
    if (one.shot.intrinsics) {
      out.shot.intrinsics = one.shot.intrinsics;
      out.shot.lens_file = one.shot.lens_file;
      out.shot.lens_note = one.shot.lens_note;
    }
    if (one.T_lens_first) out.T_lens_first = one.T_lens_first;
    if (!one.shot.T_lens_scanner && !one.T_first_scanner) continue;
    out.shot.T_lens_scanner = one.shot.T_lens_scanner;
    out.shot.pose_note = one.shot.pose_note;
    out.T_first_scanner = one.T_first_scanner;
  }
  if (out.T_first_scanner)
    out.shot.T_lens_scanner = out.T_lens_first ? *out.T_lens_first * *out.T_first_scanner : *out.T_first_scanner;
  return out.shot;
}

fusion::CameraIntrinsics read_lens(const std::string& path) {
  const ShotCalibration found = read_shot_calibration({path});
  if (!found.intrinsics) throw InputError(path + ": has no lens (lens: of hueline, or one that docs/colour.md lists)");
  std::fputs(found.lens_note.c_str(), stdout);
  return *found.intrinsics;
}

fusion::CameraIntrinsics fit_to_image(const fusion::CameraIntrinsics& lens, const std::string& lens_file, int width,
                                      int height, const std::string& image_file, OtherSize other) {
  fusion::CameraIntrinsics out = lens;
  out.width = static_cast<std::uint32_t>(width);
  out.height = static_cast<std::uint32_t>(height);
  const bool is_other = lens.width != 0 && lens.height != 0 && (lens.width != out.width || lens.height != out.height);
  if (is_other && other == OtherSize::Refuse)
    throw config::ConfigError(
        fmt::format("{} has {} x {} px, the lens of {} has {} x {}: an image of another camera, or another cut or size "
                    "of it. If the image is that of the lens without its right or "
                    "lower border, or the size beside the lens is wrong, give --image-size same-pixels; if it is the "
                    "whole image made smaller or larger, --image-size scaled",
                    image_file, width, height, lens_file, lens.width, lens.height));
  if (is_other && other == OtherSize::Scaled) {
    const Eigen::Array2d scale(double(width) / lens.width, double(height) / lens.height);
    out.focal_px = lens.focal_px.array() * scale;
    out.principal_point_px = (lens.principal_point_px.array() + 0.5) * scale - 0.5;  // pixel centres at whole numbers
  }
  if (const std::string wrong = out.validate(); !wrong.empty()) throw config::ConfigError(lens_file + ": " + wrong);
  return out;
}

const std::vector<std::string> kImageTurnWords = {"auto", "stored", "shown"};

ImageTurn image_turn(const std::string& word) {
  return word == "shown" ? ImageTurn::Shown : word == "stored" ? ImageTurn::Stored : ImageTurn::Auto;
}

bool is_turned(const fusion::CameraIntrinsics& lens, const std::string& lens_file, int width, int height,
               int orientation, const std::string& image_file, ImageTurn turn) {
  if (orientation == 1) return false;
  const bool is_decided_by_shape = swaps_sides(orientation) && width != height && lens.width != lens.height;
  if (turn == ImageTurn::Auto && !is_decided_by_shape)
    throw config::ConfigError(fmt::format(
        "{} is to be shown {} by its EXIF data, and {} does not say whether its lens is that of the image as stored or "
        "as shown. Give --image-turn stored if hueline calibrated it, or a program that leaves EXIF data aside; "
        "--image-turn shown if a program did that turns photographs, as OpenCV's imread does",
        image_file, orientation_words(orientation), lens_file));
  const bool is_lens_as_stored = (lens.width > lens.height) == (width > height);
  const bool out = turn == ImageTurn::Shown || (turn == ImageTurn::Auto && !is_lens_as_stored);
  std::fputs(fmt::format("{} is to be shown {} by its EXIF data; it is used as {}{}\n", image_file,
                         orientation_words(orientation), out ? "shown" : "stored",
                         turn == ImageTurn::Auto ? ", which has the shape of the lens" : "")
                 .c_str(),
             stdout);
  return out;
}

const std::vector<std::string> kImageSizeWords = {"refuse", "same-pixels", "scaled"};

OtherSize other_size(const std::string& word) {
  return word == "scaled" ? OtherSize::Scaled : word == "same-pixels" ? OtherSize::SamePixels : OtherSize::Refuse;
}

}  // namespace hueline::apps
