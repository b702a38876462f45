#include "apps/calibrate/calibrate_shot.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "apps/calibrate/calibrate.hpp"
#include "apps/colour/shot_calibration.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "calibration/mount/alignment.hpp"
#include "calibration/mount/mount_report.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"
#include "storage/pcd_reader.hpp"
#include "survey/lens_values.hpp"

namespace hueline::apps {

using namespace calibration;

namespace {

// Largest difference between the result of a half of the scene and that of the whole.
constexpr double kMostAway_deg = 1.5;

/// Returns the shot with the samples of every other sector of the scanner's azimuth. They are an independent part of
/// the scene.
AlignmentShot half_of(const AlignmentShot& shot, int which) {
  constexpr double kSector_deg = 8;
  auto part = std::make_shared<std::vector<LaserSample>>();
  for (const LaserSample& sample : *shot.samples) {
    const double azimuth_deg = std::atan2(sample.p_body.y(), sample.p_body.x()) * 180 / std::numbers::pi + 360;
    if (static_cast<int>(azimuth_deg / kSector_deg) % 2 == which) part->push_back(sample);
  }
  AlignmentShot out = shot;
  out.samples = std::move(part);
  return out;
}

/// One lens, its image and the points of the same moment. The scanner takes the place of the vehicle, and the lens that
/// of the head.
struct Scene {
  AlignmentLens lens;
  AlignmentShot shot;
};

/// Returns the points of a PCD file as samples. Errors: those of read_pcd(); Malformed if a field is missing.
Result<std::vector<LaserSample>> read_samples(const std::string& path) {
  const auto cloud = storage::read_pcd(path);
  if (!cloud.ok()) return cloud.error();
  const auto x = cloud->column("x"), y = cloud->column("y"), z = cloud->column("z"),
             intensity = cloud->column("intensity");
  if (x.empty() || y.empty() || z.empty() || intensity.empty())
    return Error{ErrorCode::Malformed, path + ": has no fields x, y, z, intensity"};
  std::vector<Eigen::Vector3f> points;
  std::vector<float> strengths;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3f p(static_cast<float>(x[i]), static_cast<float>(y[i]), static_cast<float>(z[i]));
    if (!p.allFinite()) continue;
    points.push_back(p);
    strengths.push_back(static_cast<float>(intensity[i]));
  }
  return laser_samples(points, strengths);
}

/// Reads the image and the cloud. `known` has the lens. Errors: those of the two files. Throws config::ConfigError if
/// the image does not have the size of the lens.
Result<Scene> read_scene(const ShotFiles& files, const ShotCalibration& known) {
  auto image = read_grey_image(files.image);
  if (!image.ok()) return image.error();
  auto samples = read_samples(files.cloud);
  if (!samples.ok()) return samples.error();
  const fusion::CameraIntrinsics intrinsics = fit_to_image(*known.intrinsics, known.lens_file, image->width,
                                                           image->height, files.image, other_size(files.image_size));
  Scene scene;
  scene.lens.values = survey::lens_values(intrinsics);
  scene.lens.max_angle = intrinsics.max_angle;
  scene.shot.image = std::move(*image);
  scene.shot.samples = std::make_shared<const std::vector<LaserSample>>(std::move(*samples));
  return scene;
}

/// Estimates the pose from each half of the scene alone, from the same start, and prints how far it is from that of the
/// whole. One shot has no stretches whose differences give the uncertainty; the halves replace them. Returns whether
/// both halves agree with the whole.
bool do_halves_agree(const Scene& scene, const Transform<Body, CameraHead>& start, const AlignmentConfig& config,
                     const Alignment& whole) {
  bool do_agree = true;
  std::string words;
  for (const int half : {0, 1}) {
    const auto part = align_head({scene.lens}, {half_of(scene.shot, half)}, start, config);
    const double away_deg =
        part.ok() ? part->T_body_head.rotation.angularDistance(whole.T_body_head.rotation) * 180 / std::numbers::pi : 0;
    do_agree &= part.ok() && !(away_deg > kMostAway_deg);
    words += (half ? "; the other: " : "half of the scene alone: ") +
             (part.ok() ? fmt::format("{:.2f} deg away", away_deg) : part.error().message);
  }
  std::fputs((words + "\n").c_str(), stdout);
  return do_agree;
}

/// Writes T_lens_scanner.yaml into the folder and prints its name.
Status write_pose(const ShotFiles& files, const Transform<Lens, Scanner>& T) {
  const auto folder = OutputFolder::open(files.out);
  if (!folder.ok()) return folder.error();
  CalibrationRecord record;
  record.method = "mount";
  record.date = files.date;
  record.data = {std::filesystem::path(files.image).filename().string(),
                 std::filesystem::path(files.cloud).filename().string(),
                 "outlines and intensity of one moment, no targets"};
  const auto path = std::filesystem::path(files.out) / "T_lens_scanner.yaml";
  const Status written = write_output(path, mounting_yaml("T_lens_scanner", T.rotation, T.translation, record, 0));
  if (written.ok()) std::fputs((path.string() + "\n").c_str(), stdout);
  return written;
}

}  // namespace

int calibrate_shot(const ShotFiles& files) {
  const ShotCalibration known = read_shot_calibration({files.lens}), start = read_shot_calibration({files.start});
  if (!known.intrinsics) throw config::ConfigError(files.lens + ": has no lens (lens: of hueline, cam_K, K or P2)");
  if (!start.T_lens_scanner)
    throw config::ConfigError(files.start +
                              ": has no pose of the laser (T_lens_scanner: of hueline, sensor_calib, T or Tr)");
  const auto scene = read_scene(files, known);
  if (!scene.ok()) {
    log_error(scene.error().message);
    return kInputUnreadable;
  }
  const Transform<Scanner, Lens> T_scanner_lens = start.T_lens_scanner->inverse();
  const Transform<Body, CameraHead> T_body_head{T_scanner_lens.rotation, T_scanner_lens.translation};
  AlignmentConfig config;
  config.search_deg = files.search_deg;
  config.groups = 0;
  config.use_relation = false;  // one image has too few patches for this step
  const auto found = align_head({scene->lens}, {scene->shot}, T_body_head, config);
  if (!found.ok()) {
    log_error(found.error().message);
    return kInputUnreadable;
  }
  const Transform<Lens, Scanner> T{found->T_body_head.rotation.conjugate(),
                                   -(found->T_body_head.rotation.conjugate() * found->T_body_head.translation)};
  std::fputs(
      fmt::format("{} points; score {:.4f} at the start, {:.4f} of the result; rotated by {:.3f} deg from the start\n",
                  found->samples, found->score_start, found->score,
                  T.rotation.angularDistance(start.T_lens_scanner->rotation) * 180 / std::numbers::pi)
          .c_str(),
      stdout);
  if (!do_halves_agree(*scene, T_body_head, config, *found)) {
    log_error(
        "this image and cloud do not fix the pose: one half of the scene gives a result more than {} deg away, or "
        "none. Take a pair with posts and edges all over the image, or use --points or --recording",
        kMostAway_deg);
    return kNothingCame;
  }
  if (files.out.empty()) return kDone;
  if (const Status written = write_pose(files, T); !written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  return kDone;
}

}  // namespace hueline::apps
