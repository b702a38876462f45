#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "products/cloud_export.hpp"
#include "products/trajectory_export.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {
namespace {

struct Options {
  std::string drive, out;
  std::string profile = "laz";
  std::string at, rig;
  double rate_hz = 0;
  int threads = 2;
};

/// Returns the cloud of a drive's folder, or the path itself.
std::string cloud_of(const std::string& path) {
  return runtime::drive_file(runtime::drive_file(path, "cloud.las"), "cloud.laz");
}

int export_cloud(const Options& options) {
  products::CloudExport config;
  config.threads = options.threads;
  const std::string cloud = cloud_of(options.drive);
  const auto done = options.profile == "copc" ? products::export_copc(cloud, options.out, config)
                                              : products::export_laz(cloud, options.out, config);
  if (!done.ok()) {
    log_error(done.error().message);
    return opening_status(done.error());
  }
  std::error_code ignored;
  fmt::print("{}: {} points in {} {}, {} bytes, {:.3f} of the size of {}\n", options.out, done->points, done->nodes,
             options.profile == "copc" ? "nodes of an octree" : "chunks", done->bytes,
             static_cast<double>(done->bytes) / static_cast<double>(std::filesystem::file_size(cloud, ignored)), cloud);
  if (!done->source_was_cut) return kDone;
  log_error("{} ends before its last point: everything that is whole was written", cloud);
  return kInputUnreadable;
}

/// Returns the place of a sensor in Body; the sensor's name is empty for Body's origin.
Result<Point<Body>> place_of(const config::Rig& rig, const std::string& sensor) {
  if (sensor.empty()) return Point<Body>{};
  std::string known;
  for (const auto& one : rig.sensors) {
    for (const auto& laser : rig.geometry.lasers)
      if (laser.sensor == one.id && one.name == sensor) return Point<Body>{laser.T_body_scanner.translation};
    for (const auto& lens : rig.geometry.head.lenses)
      if (lens.camera == one.id && one.name == sensor) return Point<Body>{rig.geometry.head.T_body_head.translation};
    known += (known.empty() ? "" : ", ") + one.name;
  }
  return Error{ErrorCode::Invalid,
               fmt::format("--at {}: no scanner or camera has that name; the rig's sensors are: {}", sensor, known)};
}

int export_trajectory(const Options& options) {
  auto recording = runtime::Recording::open(options.drive, options.rig);
  if (!recording.ok()) {
    log_error(recording.error().message);
    return opening_status(recording.error());
  }
  const auto place = place_of(recording->rig, options.at);
  if (!place.ok()) {
    log_error(place.error().message);
    return kWrongUse;
  }
  auto file = products::TrajectoryFile::create(options.out, recording->rig.name);
  if (!file.ok()) {
    log_error(file.error().message);
    return file.error().code == ErrorCode::Invalid ? kWrongUse : kOutputRefused;
  }
  Status written;
  products::TrajectoryRows rows({recording->rig.colouring.trajectory, options.rate_hz, *place},
                                [&](const products::TrajectoryRow& row) {
                                  if (written.ok()) written = (*file)->add(row);
                                });
  const Status read = runtime::for_each_solution(
      recording->rig, [&](const auto& take) { return recording->for_each(take); },
      [&](const InsSolution& solution) { rows.add(solution); });
  rows.finish();
  if (const Status closed = (*file)->close(); written.ok()) written = closed;
  if (!written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  fmt::print("{}: {} poses{}\n", options.out, (*file)->rows(), options.at.empty() ? "" : " of " + options.at);
  if (rows.missing() > 0)
    log_warning("{} poses are missing, because solutions of the POS are missing there", rows.missing());
  if (!read.ok()) {
    log_error("{}: everything that is whole was written", read.error().message);
    return kInputUnreadable;
  }
  return (*file)->rows() == 0 ? kNothingCame : kDone;
}

}  // namespace

void add_export(Command& all) {
  auto options = std::make_shared<Options>();
  Command command = all.command("export", "write the results of a drive in the files that other programs import");
  command.required("DRIVE", options->drive, "a drive's folder; or a cloud (.las, .laz) for the profiles laz and copc")
      .reads(options->drive);
  command.setting("--profile", options->profile, "what to write", {"laz", "copc", "trajectory"});
  command.required("--out", options->out, "the file to write").writes(options->out);
  command.setting("--threads", options->threads, "number of threads that compress; it does not change the file",
                  {1, 64});
  command.setting("--rate", options->rate_hz,
                  "trajectory: poses a second, at whole multiples of the interval; 0: one for each good solution",
                  {0.0, 10000.0});
  command
      .option("--at", options->at,
              "trajectory: the scanner or camera whose places are given; without it the origin of the vehicle's frame")
      .option("--rig", options->rig, "trajectory: rig file to use instead of the recorded one")
      .reads(options->rig);
  command.footer(
      "laz  the cloud as LAZ 1.4 with all its fields, extra bytes included\n"
      "copc  the same as COPC 1.0: an octree that viewers load in parts, from a disk or a web server (.copc.laz)\n"
      "trajectory  the POS's solutions; the ending of --out says how: .out or .sbet (SBET, with .smrmsg beside it), "
      ".csv, .gpx, .kml, .geojson");
  command.runs(
      [options] { return options->profile == "trajectory" ? export_trajectory(*options) : export_cloud(*options); });
}

}  // namespace hueline::apps
