#include "apps/calibrate_drive.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "apps/calibrate.hpp"
#include "apps/calibrate_shot.hpp"
#include "apps/drive_shots.hpp"
#include "apps/exit_code.hpp"
#include "apps/pipeline.hpp"
#include "apps/recording.hpp"
#include "apps/simulated_recording.hpp"
#include "apps/simulated_rig.hpp"
#include "calibration/mount/mount_report.hpp"
#include "config/scenario.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"

namespace hueline::apps {
namespace {

using namespace calibration;
constexpr double kDeg = 57.29577951308232;

/// A drive and the rig that it is read with.
struct Source {
  config::Rig rig;
  std::optional<Transform<Body, CameraHead>> truth;  ///< of the simulator
  std::optional<Recording> recording;
  std::optional<sim::Scenario> scenario;
  std::optional<sim::Drive> drive;

  Status feed(const std::function<bool(const Packet&)>& use) {
    if (recording) return recording->for_each(use);
    const auto timeline = sim::scenario_timeline(*scenario, *drive);
    if (!timeline.ok()) return timeline.error();
    return for_each_simulated_packet(*drive, timeline->timeline, rig, use);
  }
};

Result<Source> open(const DriveFiles& files) {
  Source out;
  if (!files.recording.empty()) {
    auto recording = Recording::open(files.recording, files.rig);
    if (!recording.ok()) return recording.error();
    out.rig = recording->rig;
    out.recording = std::move(*recording);
    return out;
  }
  out.scenario = config::load_scenario(files.scenario);
  auto drive = sim::generate(*out.scenario, files.cache);
  if (!drive.ok()) return drive.error();
  out.drive = std::move(*drive);
  const config::Rig perfect = config::parse_rig(simulated_rig(*out.scenario, {}, "lens"), "simulated rig");
  out.truth = perfect.geometry.head.T_body_head;
  out.rig = files.rig.empty() ? perfect : config::load_rig(files.rig);
  if (files.off_deg > 0) {
    // About an axis that is none of the head's.
    const Eigen::AngleAxisd off(files.off_deg / kDeg, Eigen::Vector3d(1, -2, 1.5).normalized());
    out.rig.geometry.head.T_body_head.rotation = (out.rig.geometry.head.T_body_head.rotation * off).normalized();
  }
  return out;
}

std::vector<AlignmentLens> lenses_of(const config::Rig& rig) {
  std::vector<AlignmentLens> out;
  for (const auto& lens : rig.geometry.head.lenses) out.push_back({lens_values(lens.intrinsics), lens.T_head_lens, lens.intrinsics.max_angle});
  return out;
}

}  // namespace

int calibrate_drive(const DriveFiles& files) {
  auto source = open(files);
  if (!source.ok()) {
    spdlog::error("{}", source.error().message);
    return kInputUnreadable;
  }
  const Transform<Body, CameraHead> start = source->rig.geometry.head.T_body_head;
  DriveShots::Config wanted;
  wanted.every = files.every;
  DriveShots gathered(source->rig, wanted);
  Status fed;
  {
    Pipeline pipeline(source->rig, 2, gathered);
    fed = source->feed([&](const Packet& packet) {
      pipeline.process(packet);
      return true;
    });
    pipeline.flush();
  }
  if (!fed.ok()) spdlog::warn("{}", fed.error().message);
  const auto shots = gathered.shots();
  AlignmentConfig config;
  config.search_deg = files.search_deg;
  config.search_time_s = files.search_time_ms * 1e-3;
  const auto found = align_head(lenses_of(source->rig), shots, start, config);
  if (!found.ok()) {
    spdlog::error("{}", found.error().message);
    return kInputUnreadable;
  }
  const Eigen::Vector4d& sigma = found->sigma;
  std::string said = fmt::format("{} exposures, {} lens images, {} samples; score {:.4f} at the start, {:.4f} found\n", gathered.exposures(), shots.size(), found->samples,
                                 found->score_start, found->score);
  said += fmt::format("turned by {:.3f} deg against the start, +- {:.3f} {:.3f} {:.3f} deg about the head's axes; images later than said by {:.2f} +- {:.2f} ms\n",
                      found->T_body_head.rotation.angularDistance(start.rotation) * kDeg, sigma[0] * kDeg, sigma[1] * kDeg, sigma[2] * kDeg, found->time_offset_s * 1e3, sigma[3] * 1e3);
  if (source->truth) said += fmt::format("against the simulator's truth: {:.4f} deg\n", found->T_body_head.rotation.angularDistance(source->truth->rotation) * kDeg);
  std::fputs(said.c_str(), stdout);
  if (files.out.empty()) return kDone;
  CalibrationRecord record;
  record.method = "mount";
  record.date = files.date;
  record.data = {files.recording.empty() ? files.scenario : files.recording, fmt::format("{} lens images, no targets", shots.size()),
                 fmt::format("images later than said by {:.2f} ms: add to strobe_delay_us", found->time_offset_s * 1e3)};
  record.residual_unit = "px";
  record.parameters = {"turn_head_x_deg", "turn_head_y_deg", "turn_head_z_deg", "time_offset_ms"};
  record.sigma = {sigma[0] * kDeg, sigma[1] * kDeg, sigma[2] * kDeg, sigma[3] * 1e3};
  std::filesystem::create_directories(files.out);
  const auto path = std::filesystem::path(files.out) / "T_body_head.yaml";
  if (const Status written = write_text(path, mounting_yaml("T_body_head", found->T_body_head.rotation, found->T_body_head.translation, record, 0)); !written.ok()) {
    spdlog::error("{}", written.error().message);
    return kOutputRefused;
  }
  std::fputs((path.string() + "\n").c_str(), stdout);
  return kDone;
}

}  // namespace hueline::apps
