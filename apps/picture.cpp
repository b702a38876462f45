#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "storage/cloud_picture.hpp"
#include "storage/las_reader.hpp"

namespace hueline::apps {
namespace {

struct Options {
  std::string cloud, above, street;
  double at = 0.35, eye_height_m = 2.2, heading_deg = -1;
};

/// Where the vehicle was at a share of the drive: the centre of what the laser hit within a short time lies along the street, so the
/// view goes from the centre at `at` towards the centre a few seconds later.
Result<storage::StreetViewConfig> viewpoint(const Options& options) {
  auto reader = storage::LasReader::open(options.cloud);
  if (!reader.ok()) return reader.error();
  const std::uint64_t total = reader->header().point_count;
  const auto first = static_cast<std::uint64_t>(options.at * static_cast<double>(total));
  const std::uint64_t span = total / 20 + 1;
  Eigen::Vector3d sums[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double counts[2] = {0, 0}, ground = 1e9;
  std::uint64_t index = 0;
  std::vector<storage::LasPoint> batch;
  for (;;) {
    if (Status read = reader->next(batch); !read.ok()) return read.error();
    if (batch.empty()) break;
    for (const auto& point : batch) {
      const std::uint64_t i = index++;
      if (i < first || i >= first + 2 * span) continue;
      const int which = i < first + span ? 0 : 1;
      sums[which] += Eigen::Vector3d(point.x, point.y, point.z);
      counts[which] += 1;
      ground = std::min(ground, point.z);
    }
  }
  if (counts[0] == 0 || counts[1] == 0) return Error{ErrorCode::Invalid, options.cloud + ": too few points for a view from the street"};
  const Eigen::Vector3d from = sums[0] / counts[0], to = sums[1] / counts[1];
  storage::StreetViewConfig view;
  view.position = {from.x(), from.y(), ground + options.eye_height_m};
  view.heading = options.heading_deg >= 0 ? options.heading_deg * std::numbers::pi / 180 : std::atan2(to.x() - from.x(), to.y() - from.y());
  return view;
}

int picture(const Options& options) {
  if (!options.above.empty()) {
    auto view = storage::picture_from_above(options.cloud);
    Status done = view.ok() ? storage::write_png(options.above, view->image) : Status(view.error());
    if (!done.ok()) {
      log_error(done.error().message);
      return view.ok() ? kOutputRefused : kInputUnreadable;
    }
    std::fputs(fmt::format("{}: {:.3f} m a pixel, upper left at {:.1f} E {:.1f} N\n", options.above, view->cell_m, view->west, view->north).c_str(), stdout);
  }
  if (!options.street.empty()) {
    auto at = viewpoint(options);
    Result<storage::RgbImage> view = at.ok() ? storage::picture_from_street(options.cloud, *at) : Result<storage::RgbImage>(at.error());
    Status done = view.ok() ? storage::write_png(options.street, *view) : Status(view.error());
    if (!done.ok()) {
      log_error(done.error().message);
      return view.ok() ? kOutputRefused : kInputUnreadable;
    }
    std::fputs((options.street + "\n").c_str(), stdout);
  }
  return kDone;
}

}  // namespace

void add_picture(Command& all) {
  auto options = std::make_shared<Options>();
  Command command = all.command("picture", "draw a cloud (LAS) from above and from the street");
  command.required("CLOUD", options->cloud, "cloud.las, or any LAS 1.0 to 1.4");
  command.option("--above", options->above, "PNG of the view from above");
  command.option("--street", options->street, "PNG of a view along the street");
  command.setting("--at", options->at, "where the street view stands, as a share of the drive", {0.0, 0.9});
  command.setting("--eye-height", options->eye_height_m, "m above the lowest point around");
  command.option("--heading", options->heading_deg, "degrees clockwise from grid north; default: along the drive");
  command.reads(options->cloud).writes(options->above).writes(options->street);
  command.runs([options] { return picture(*options); });
}

}  // namespace hueline::apps
