#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "apps/exit_code.hpp"
#include "apps/export/drive_path.hpp"
#include "apps/export/profile.hpp"
#include "apps/log.hpp"
#include "products/trajectory_export.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {
namespace {

/// Returns the place of a sensor in Body; the sensor's name is empty for Body's origin.
Result<Point<Body>> place_of(const config::Rig& rig, const std::string& sensor) {
  if (sensor.empty()) return Point<Body>{};
  std::string known;
  for (const auto& one : rig.sensors) {
    std::optional<Point<Body>> place;
    for (const auto& laser : rig.geometry.lasers)
      if (laser.sensor == one.id) place = Point<Body>{laser.T_body_scanner.translation};
    for (const auto& lens : rig.geometry.head.lenses)
      if (lens.camera == one.id) place = Point<Body>{rig.geometry.head.T_body_head.translation};
    if (place && one.name == sensor) return *place;
    if (place) known += (known.empty() ? "" : ", ") + one.name;
  }
  return Error{ErrorCode::Invalid, fmt::format("--at {}: no scanner or camera of the rig has that name; it has: {}",
                                               sensor, known.empty() ? "none" : known)};
}

class TrajectoryProfile : public ExportProfile {
 public:
  const char* word() const override { return "trajectory"; }
  const char* help() const override {
    return "the POS's solutions, or those of --trajectory; the ending of --out says how: .out or .sbet (SBET, with "
           ".smrmsg beside it), .csv, "
           ".gpx, .kml, .geojson";
  }

  void declare(Command& command) override {
    command.setting("--rate", rate_hz_,
                    "trajectory: poses a second, at whole multiples of the interval; 0: one for each good solution",
                    {0.0, 10000.0});
    command.option("--at", at_,
                   "trajectory: the scanner or camera whose places are given; without it the origin of the vehicle's "
                   "frame");
  }

  int run(const ExportWords& words) override {
    constexpr double kLeastRate_hz = 0.001;
    if (rate_hz_ > 0 && rate_hz_ < kLeastRate_hz) {
      log_error("--rate {}: allowed is 0, or {} to 10000", rate_hz_, kLeastRate_hz);
      return kWrongUse;
    }
    auto recording = runtime::Recording::open(words.drive, words.rig);
    if (!recording.ok()) {
      log_error(recording.error().message);
      return opening_status(recording.error());
    }
    const auto place = place_of(recording->rig, at_);
    if (!place.ok()) {
      log_error(place.error().message);
      return kWrongUse;
    }
    if (const Status there = words.trajectory.check_files(); !there.ok()) {
      log_error(there.error().message);
      return opening_status(there.error());
    }
    auto file = products::TrajectoryFile::create(words.out, recording->rig.name);
    if (!file.ok()) {
      log_error(file.error().message);
      return file.error().code == ErrorCode::Invalid ? kWrongUse : kOutputRefused;
    }
    Status written;
    products::TrajectoryRows rows({recording->rig.colouring.trajectory, rate_hz_, *place},
                                  [&](const products::TrajectoryRow& row) {
                                    if (written.ok()) written = (*file)->add(row);
                                  });
    const auto opened =
        for_each_of_path(words.trajectory, *recording, [&](const InsSolution& solution) { rows.add(solution); });
    if (!opened.ok()) {
      log_error(opened.error().message);
      return opening_status(opened.error());
    }
    const Status& read = *opened;
    rows.finish();
    if (const Status closed = (*file)->close(); written.ok()) written = closed;
    if (!written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
    fmt::print("{}: {} poses{}\n", words.out, (*file)->rows(), at_.empty() ? "" : " of " + at_);
    if (rows.missing() > 0)
      log_warning("{} poses are missing, because solutions of the POS are missing there", rows.missing());
    if (!read.ok()) {
      log_error("{}: everything that is whole was written", read.error().message);
      return kInputUnreadable;
    }
    return (*file)->rows() == 0 ? kNothingCame : kDone;
  }

 private:
  std::string at_;
  double rate_hz_ = 0;
};

}  // namespace

std::unique_ptr<ExportProfile> make_trajectory_profile() { return std::make_unique<TrajectoryProfile>(); }

}  // namespace hueline::apps
