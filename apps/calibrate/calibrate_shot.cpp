#include "apps/calibrate/calibrate_shot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "apps/calibrate/calibrate.hpp"
#include "apps/colour/shot_calibration.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "calibration/mount/mount_report.hpp"
#include "calibration/mount/shot_alignment.hpp"
#include "config/section.hpp"
#include "core/angle.hpp"
#include "core/exif_orientation.hpp"
#include "core/output_file.hpp"
#include "runtime/lens_values.hpp"
#include "storage/cloud_file.hpp"
#include "storage/shot_cloud.hpp"

namespace hueline::apps {

using namespace calibration;

namespace {

constexpr double kFarthestNearest_m = 1000;  // of a cloud, which no scanner's frame exceeds

/// Reads the returns of a cloud into `shot`. Errors: those of read_cloud(); Malformed if a field is missing.
Status read_returns(const std::string& path, Shot& shot) {
  const auto cloud = storage::read_cloud(path);
  if (!cloud.ok()) return cloud.error();
  const auto x = cloud->column("x"), y = cloud->column("y"), z = cloud->column("z"),
             intensity = cloud->column(storage::intensity_field(*cloud));
  if (x.empty() || y.empty() || z.empty() || intensity.empty())
    return Error{ErrorCode::Malformed, fmt::format("{}: x, y, z and intensity are needed; its fields: {}", path,
                                                   fmt::join(cloud->fields, ", "))};
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < x.size(); ++i)
    if (const double range_m = Eigen::Vector3d(x[i], y[i], z[i]).norm(); range_m < nearest_m) nearest_m = range_m;
  if (std::isfinite(nearest_m) && nearest_m > kFarthestNearest_m)
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: its nearest point is {:.0f} m from its origin, as in coordinates of a map; the cloud "
                             "is wanted in the scanner's frame, with the scanner at the origin",
                             path, nearest_m)};
  for (std::size_t i = 0; i < x.size(); ++i) {
    shot.p_scanner.emplace_back(static_cast<float>(x[i]), static_cast<float>(y[i]), static_cast<float>(z[i]));
    shot.intensity.push_back(static_cast<float>(intensity[i]));
  }
  return {};
}

/// Reads the image and the cloud. Errors: those of the two files. Throws config::ConfigError if
/// the image does not have the size of the lens.
Result<Shot> read_shot(const ShotFiles& files, const fusion::CameraIntrinsics& lens) {
  auto image = read_grey_image(files.image);
  if (!image.ok()) return image.error();
  if (is_turned(lens, files.lens, image->width, image->height, image->orientation, files.image,
                image_turn(files.image_turn)))
    turn_as_shown(image->orientation, image->width, image->height, image->pixels);
  Shot shot;
  if (const Status read = read_returns(files.cloud, shot); !read.ok()) return read.error();
  const fusion::CameraIntrinsics intrinsics =
      fit_to_image(lens, files.lens, image->width, image->height, files.image, other_size(files.image_size));
  shot.lens = runtime::lens_values(intrinsics);
  shot.max_angle = intrinsics.max_angle;
  shot.image = std::move(*image);
  return shot;
}

/// Returns what the search found, in words.
std::string figures_of(const ShotAlignment& found, const Transform<Lens, Scanner>& start) {
  const Eigen::Vector3d sigma_deg = found.covariance.diagonal().cwiseSqrt() * kDegPerRad;
  return fmt::format(
      "{} pairs of returns in the image, {} of them at outlines; mutual information {:.4f} nat at the start, {:.4f} of "
      "the result, {:.4f} of the best other maximum\n"
      "rotated by {:.3f} deg from the start, sigma {:.3f} {:.3f} {:.3f} deg about the lens's axes; {} of {} parts of "
      "the scene end elsewhere\n",
      found.pairs, found.outlines, found.score_start, found.score, found.score_elsewhere,
      found.T_lens_scanner.rotation.angularDistance(start.rotation) * kDegPerRad, sigma_deg.x(), sigma_deg.y(),
      sigma_deg.z(), found.elsewhere, found.subsets);
}

/// Aligns the shot from starts that are wrong by `files.off_deg`, and prints how far each result is from the start
/// without that error. Returns the exit status: whether each of them is determined.
int try_starts(const ShotFiles& files, const Shot& shot, const Transform<Lens, Scanner>& given,
               const ShotAlignmentConfig& config) {
  int status = kDone;
  for (int number = 0; number < files.starts; ++number) {
    const Eigen::Quaterniond off = off_start(files.off_deg, number, files.starts);
    const auto found = align_shot(shot, {(off * given.rotation).normalized(), off * given.translation}, config);
    if (!found.ok()) {
      log_error(found.error().message);
      return kInputUnreadable;
    }
    std::fputs(fmt::format("start {} of {}: {:.3f} deg from the given pose, sigma {:.3f} deg, {}{}\n", number + 1,
                           files.starts, found->T_lens_scanner.rotation.angularDistance(given.rotation) * kDegPerRad,
                           found->sigma() * kDegPerRad,
                           found->is_determined() ? "determined" : "not determined: ", fmt::join(found->doubts, "; "))
                   .c_str(),
               stdout);
    if (!found->is_determined()) status = kNothingCame;
  }
  return status;
}

/// Returns the record of the rotation. Its place is that of the start, so that only the rotation has sigmas.
CalibrationRecord record_of(const ShotFiles& files, const ShotAlignment& found) {
  CalibrationRecord record;
  record.method = "mount";
  record.date = files.date;
  record.data = {std::filesystem::path(files.image).filename().string(),
                 std::filesystem::path(files.cloud).filename().string(),
                 fmt::format("outlines and reflectivity of one moment, no targets; {} pairs of returns", found.pairs),
                 "position as in " + std::filesystem::path(files.start).filename().string()};
  record.parameters = {"turn_lens_x_deg", "turn_lens_y_deg", "turn_lens_z_deg"};
  for (int i = 0; i < 3; ++i) {
    record.sigma.push_back(std::sqrt(found.covariance(i, i)) * kDegPerRad);
    for (int j = i; j < 3; ++j) record.covariance.push_back(found.covariance(i, j) * kDegPerRad * kDegPerRad);
  }
  return record;
}

/// Writes T_lens_scanner.yaml into the folder and prints its name.
Status write_pose(const ShotFiles& files, const ShotAlignment& found) {
  const auto folder = OutputFolder::open(files.out);
  if (!folder.ok()) return folder.error();
  const auto path = std::filesystem::path(files.out) / "T_lens_scanner.yaml";
  const auto& T = found.T_lens_scanner;
  const Status written =
      write_output(path, mounting_yaml("T_lens_scanner", T.rotation, T.translation, record_of(files, found), 0));
  if (written.ok()) std::fputs((path.string() + "\n").c_str(), stdout);
  return written;
}

}  // namespace

int calibrate_shot(const ShotFiles& files) {
  const fusion::CameraIntrinsics lens = read_lens(files.lens);
  if (!read_shot_calibration({files.start}).T_lens_scanner)
    throw config::ConfigError(files.start +
                              ": has no pose of the laser (T_lens_scanner: of hueline, or one that docs/colour.md "
                              "lists)");
  // The file of the lens may hold a part of the pose.
  const ShotCalibration start = read_shot_calibration({files.lens, files.start});
  std::fputs(start.pose_note.c_str(), stdout);
  const auto shot = read_shot(files, lens);
  if (!shot.ok()) {
    log_error(shot.error().message);
    return kInputUnreadable;
  }
  ShotAlignmentConfig config;
  config.search_deg = files.search_deg;
  if (files.off_deg > 0) return try_starts(files, *shot, *start.T_lens_scanner, config);
  const auto found = align_shot(*shot, *start.T_lens_scanner, config);
  if (!found.ok()) {
    log_error(found.error().message);
    return kInputUnreadable;
  }
  std::fputs(figures_of(*found, *start.T_lens_scanner).c_str(), stdout);
  if (!found->is_determined()) {
    log_error(
        "not determined: {}. Take a pair with posts, edges and markings all over the image, or use --points or "
        "--recording",
        fmt::join(found->doubts, "; "));
    return kNothingCame;
  }
  if (files.out.empty()) return kDone;
  if (const Status written = write_pose(files, *found); !written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  return kDone;
}

}  // namespace hueline::apps
