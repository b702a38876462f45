#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/inspect/unfinished_run.hpp"
#include "apps/log.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"
#include "runtime/recording.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/cloud_picture.hpp"
#include "storage/las_reader.hpp"

namespace hueline::apps {
namespace {

struct PictureOptions {
  std::string cloud, above, street, moving;
  double at = 0.35, eye_height_m = 2.2, heading_deg = -1;
  double drive_s = storage::MovingViewConfig().drive_s, speed = storage::MovingViewConfig().speed;
};

/// Estimates where the vehicle was at the share `at` of the drive. The centre of the points of a short time lies along
/// the street, so the view goes from the centre at `at` towards the centre of the points after it.
Result<storage::StreetViewConfig> viewpoint(const PictureOptions& options) {
  auto reader = storage::LasReader::open(options.cloud);
  if (!reader.ok()) return reader.error();
  const auto metric = storage::crs_in_metres(*reader);
  if (!metric.ok()) return Error{metric.error().code, options.cloud + ": " + metric.error().message};
  const std::uint64_t total = reader->available();
  const auto first = static_cast<std::uint64_t>(options.at * static_cast<double>(total));
  const std::uint64_t span = total / 20 + 1;
  Eigen::Vector3d sums[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double counts[2] = {0, 0}, ground = 1e9;
  std::uint64_t index = 0;
  std::vector<storage::LasPoint> batch;
  for (;;) {
    const Status read = reader->next(batch);
    if (!read.ok() && read.error().code != ErrorCode::Truncated) return read.error();
    if (batch.empty()) break;  // a cut cloud ends early
    for (const auto& point : batch) {
      const std::uint64_t i = index++;
      if (i < first || i >= first + 2 * span) continue;
      const int which = i < first + span ? 0 : 1;
      const Eigen::Vector3d place = metric->place(point);
      sums[which] += place;
      counts[which] += 1;
      ground = std::min(ground, place.z());
    }
  }
  if (counts[0] == 0 || counts[1] == 0)
    return Error{ErrorCode::Invalid, options.cloud + ": too few points for a view from the street"};
  const Eigen::Vector3d from = sums[0] / counts[0], to = sums[1] / counts[1];
  storage::StreetViewConfig view;
  view.position = {from.x(), from.y(), ground + options.eye_height_m};
  view.heading = options.heading_deg >= 0 ? options.heading_deg * std::numbers::pi / 180
                                          : std::atan2(to.x() - from.x(), to.y() - from.y());
  return view;
}

/// Reports a picture that was written. Returns `status`, or the picture's own status if the cloud or the picture
/// failed.
int finish(const std::string& path, const Status& written, const std::string& said, const Status& read, int status) {
  if (!written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  std::fputs((path + said + "\n").c_str(), stdout);
  if (read.ok()) return status;
  log_error("{}; {} shows what there is", read.error().message, path);
  return kInputUnreadable;
}

/// Draws what was asked for of a cloud, and returns the exit status.
int draw(const PictureOptions& options) {
  if (const auto cloud = storage::LasReader::open(options.cloud); cloud.ok() && cloud->header().point_count == 0) {
    log_error("{}: a cloud without points has no picture", options.cloud);
    return kNothingCame;
  }
  int status = kDone;
  if (!options.above.empty()) {
    const auto view = storage::picture_from_above(options.cloud);
    if (!view.ok()) {
      log_error(view.error().message);
      return kInputUnreadable;
    }
    status = finish(
        options.above, storage::write_png(options.above, view->image),
        fmt::format(": {:.3f} m a pixel, upper left at {:.1f} E {:.1f} N", view->cell_m, view->west, view->north),
        view->read, status);
    if (status == kOutputRefused) return status;
  }
  if (!options.street.empty()) {
    const auto at = viewpoint(options);
    const Result<storage::StreetView> view =
        at.ok() ? storage::picture_from_street(options.cloud, *at) : Result<storage::StreetView>(at.error());
    if (!view.ok()) {
      log_error(view.error().message);
      return kInputUnreadable;
    }
    status = finish(options.street, storage::write_png(options.street, view->image), {}, view->read, status);
    if (status == kOutputRefused) return status;
  }
  if (options.moving.empty()) return status;
  storage::MovingViewConfig config;
  config.start = options.at;
  config.drive_s = options.drive_s;
  config.speed = options.speed;
  const auto view = storage::picture_while_driving(options.cloud, config);
  if (!view.ok()) {
    log_error(view.error().message);
    return kInputUnreadable;
  }
  return finish(options.moving, write_output(options.moving, view->webp),
                fmt::format(": {} frames, {:.0f} kB", view->frames, static_cast<double>(view->webp.size()) / 1000),
                view->read, status);
}

int picture(PictureOptions options) {
  if (options.above.empty() && options.street.empty() && options.moving.empty())
    throw config::ConfigError("picture: give --above PNG, --street PNG, --moving WEBP or several of them");
  for (const std::string& path : {options.above, options.street})
    if (!path.empty() && !path.ends_with(".png"))
      throw config::ConfigError(path + ": a picture is written as PNG; give a name that ends in .png");
  if (!options.moving.empty() && !options.moving.ends_with(".webp"))
    throw config::ConfigError(options.moving + ": a moving picture is written as WebP; give a name that ends in .webp");
  auto found = runtime::find_cloud(options.cloud);
  if (!found.ok()) {
    log_error(found.error().message);
    return kInputUnreadable;
  }
  options.cloud = *std::move(found);
  return work_on_cloud(options.cloud, [&] { return draw(options); });
}

}  // namespace

void add_picture(Command& all) {
  auto options = std::make_shared<PictureOptions>();
  Command command = all.command("picture", "draw a cloud (LAS) from above, from the street, and while it is coloured");
  command.required("CLOUD", options->cloud,
                   "the cloud of a drive, any other LAS file of version 1.0 to 1.4, or a drive's folder");
  command.option("--above", options->above, "PNG file for the view from above");
  command.option("--street", options->street, "PNG file for a view along the street");
  command.setting("--at", options->at,
                  "viewpoint of the street view and begin of the moving picture, as a share of the drive", {0.0, 0.9});
  command.setting("--eye-height", options->eye_height_m, "height of the viewpoint above the lowest point around it, m");
  command.option("--heading", options->heading_deg,
                 "direction of the street view, degrees clockwise from grid north; default: along the drive");
  command.option("--moving", options->moving,
                 "WebP file for a moving picture of the street while it is measured (grey) and coloured");
  command.setting("--seconds", options->drive_s, "duration of the drive that the moving picture shows, s", {0.5, 60});
  command.setting("--speed", options->speed, "speed of the moving picture, as a multiple of the drive's", {0.5, 20});
  command.reads(options->cloud).writes(options->above).writes(options->street).writes(options->moving);
  command.footer(
      "Example: hueline picture drives/today/cloud.las --above above.png --street street.png\n"
      "Exit status: 0; 3 if the cloud cannot be read; 4 if a picture cannot be written; 5 if the cloud has no "
      "points.\n"
      "More: docs/operating.md");
  command.runs([options] { return picture(*options); });
}

}  // namespace hueline::apps
