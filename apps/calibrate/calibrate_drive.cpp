#include "apps/calibrate/calibrate_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "apps/calibrate/calibrate.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/progress_bar.hpp"
#include "apps/simulate/drive_source.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "calibration/mount/mount_report.hpp"
#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "survey/drive_shots.hpp"

namespace hueline::apps {
namespace {

using namespace calibration;

/// Rotates the head about axis `number` of `count`.
Transform<Body, CameraHead> put_off(Transform<Body, CameraHead> head, double off_deg, int number, int count) {
  if (!(off_deg > 0)) return head;
  head.rotation = (head.rotation * off_start(off_deg, number, count)).normalized();
  return head;
}

std::string said_of(const Alignment& found, const Transform<Body, CameraHead>& start, const DriveSource& source) {
  const Eigen::Vector4d sigma = found.covariance.diagonal().cwiseSqrt();
  std::string said =
      found.patches > 0 ? fmt::format(
                              "the adjustment in {} patches changed the result by {:.3f} deg and {:.2f} ms; the search "
                              "had score {:.3f}, the start {:.3f}\n",
                              found.patches, found.moved.head<3>().norm() * kDegPerRad, found.moved[3] * 1e3,
                              found.score, found.score_start)
                        : fmt::format("not adjusted: {}; the search in {} samples had score {:.3f}, the start {:.3f}\n",
                                      found.not_adjusted, found.samples, found.score, found.score_start);
  said += fmt::format(
      "rotated by {:.3f} deg from the start, +- {:.4f} {:.4f} {:.4f} deg about the head's axes; the images are later "
      "than their times by {:.2f} +- {:.2f} ms\n",
      found.T_body_head.rotation.angularDistance(start.rotation) * kDegPerRad, sigma[0] * kDegPerRad,
      sigma[1] * kDegPerRad, sigma[2] * kDegPerRad, found.time_offset_s * 1e3, sigma[3] * 1e3);
  if (!source.scenario) return said;
  const config::Rig truth = config::parse_rig(simulated_rig(*source.scenario, {}, "lens"), "simulated rig");
  const Eigen::AngleAxisd off(truth.geometry.head.T_body_head.rotation.conjugate() * found.T_body_head.rotation);
  const Eigen::Vector3d turn = off.axis() * std::remainder(off.angle(), 2 * std::numbers::pi) * kDegPerRad;
  const double true_ms = to_seconds(truth.sync.cameras[0].strobe_delay - source.rig.sync.cameras[0].strobe_delay) * 1e3;
  return said + fmt::format("against the simulator's truth: {:.4f} deg ({:.4f} {:.4f} {:.4f}), {:.2f} ms\n",
                            turn.norm(), turn.x(), turn.y(), turn.z(), found.time_offset_s * 1e3 - true_ms);
}

Status write_fragment(const DriveFiles& files, const Alignment& found, std::size_t images) {
  CalibrationRecord record;
  record.method = "mount";
  record.date = files.date;
  record.data = {files.drive.recording.empty() ? files.drive.scenario : files.drive.recording,
                 fmt::format("{} lens images, no targets", images),
                 fmt::format("images later than said by {:.2f} ms: add to strobe_delay_us", found.time_offset_s * 1e3)};
  record.parameters = {"turn_head_x_deg", "turn_head_y_deg", "turn_head_z_deg", "time_offset_ms"};
  const Eigen::Vector4d unit(kDegPerRad, kDegPerRad, kDegPerRad, 1e3);
  const Eigen::Matrix4d covariance = unit.asDiagonal() * found.covariance * unit.asDiagonal();
  for (int i = 0; i < 4; ++i) {
    record.sigma.push_back(std::sqrt(covariance(i, i)));
    for (int j = i; j < 4; ++j) record.covariance.push_back(covariance(i, j));
  }
  const auto folder = OutputFolder::open(files.out);
  if (!folder.ok()) return folder.error();
  const auto path = std::filesystem::path(files.out) / "T_body_head.yaml";
  if (Status written = write_output(
          path, mounting_yaml("T_body_head", found.T_body_head.rotation, found.T_body_head.translation, record, 0));
      !written.ok())
    return written;
  std::fputs((path.string() + "\n").c_str(), stdout);
  return {};
}

}  // namespace

int calibrate_drive(const DriveFiles& files) {
  ProgressBar bar;
  auto source = DriveSource::open(files.drive, bar);
  if (!source.ok()) {
    bar.end();
    log_error(source.error().message);
    return opening_status(source.error());
  }
  if (source->scenario)
    for (auto& camera : source->rig.sync.cameras) camera.strobe_delay += from_seconds(files.off_ms * 1e-3);
  survey::DriveShots::Config wanted;
  wanted.every = files.every;
  survey::DriveShots gathered(source->rig, wanted);
  const Status fed = source->feed_without_colours(bar, source->rig, gathered);
  bar.end();
  if (!fed.ok()) log_warning(fed.error().message);
  const auto shots = gathered.shots();
  std::fputs(fmt::format("{} exposures, {} lens images\n", gathered.exposures(), shots.size()).c_str(), stdout);
  AlignmentConfig config;
  config.search_deg = files.search_deg;
  config.search_time_s = files.search_time_ms * 1e-3;
  config.progress = [&](const std::string& stage, double share) { bar.show(stage, share); };
  for (int number = 0; number < files.starts; ++number) {
    const auto start = put_off(source->rig.geometry.head.T_body_head, files.off_deg, number, files.starts);
    const auto found = align_head(gathered.lenses(), shots, start, config);
    bar.end();
    if (!found.ok()) {
      log_error(found.error().message);
      return kInputUnreadable;
    }
    std::fputs(said_of(*found, start, *source).c_str(), stdout);
    std::fflush(stdout);
    if (files.out.empty() || number > 0) continue;
    if (const Status written = write_fragment(files, *found, shots.size()); !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
  }
  return kDone;
}

}  // namespace hueline::apps
