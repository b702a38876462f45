#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/following.hpp"
#include "apps/key_options.hpp"
#include "apps/log.hpp"
#include "apps/panorama/import_tables.hpp"
#include "apps/simulate/drive_source.hpp"
#include "apps/simulate/drive_trajectory.hpp"
#include "config/drive_products.hpp"
#include "config/section.hpp"
#include "core/calendar.hpp"
#include "core/output_file.hpp"
#include "runtime/version.hpp"
#include "storage/photo_file.hpp"
#include "survey/drive_panoramas.hpp"

namespace hueline::apps {
namespace {

struct PanoramaOptions {
  DriveOptions drive;
  TrajectoryOptions trajectory;
  std::string out;
  config::PanoramaKeys keys;
  KeyOptions given;  // of `keys`
  double from_s = std::nan(""), to_s = std::nan("");
  int threads = 2;
  bool follows = false;
};

survey::DrivePanoramas::Config configuration(const PanoramaOptions& options) {
  const config::PanoramaKeys& keys = options.keys;
  survey::DrivePanoramas::Config config;
  config.choice = ExposureChoice::parse(keys.exposures).value();
  if (Status limited = config.choice.limit(options.from_s, options.to_s); !limited.ok())
    throw config::ConfigError(limited.error().message);
  config.width = keys.width_px();
  using survey::PanoramaOrientation;
  config.orientation = keys.orientation == "north"  ? PanoramaOrientation::North
                       : keys.orientation == "head" ? PanoramaOrientation::Head
                                                    : PanoramaOrientation::Heading;
  config.use_depth = keys.method == "depth";
  config.around = from_seconds(keys.around_s);
  config.threads = options.threads;
  config.rendering.blend = keys.blend == "none" ? fusion::PanoramaBlend::None : fusion::PanoramaBlend::Bands;
  config.rendering.even_gains = keys.gains == "even";
  config.rendering.hide_vehicle = keys.vehicle != "show";
  config.fill_hole = keys.vehicle == "fill";
  std::ranges::copy(keys.fill_colour(), std::begin(config.rendering.fill));
  return config;
}

storage::PhotoTags tags_of(const survey::DrivePanorama& panorama, const config::PanoramaKeys& keys, bool is_clockwise) {
  storage::PhotoTags tags;
  tags.software = std::string("hueline ") + runtime::kVersion;
  tags.description =
      fmt::format("exposure {}, GPS time {:.6f} s; altitude above the WGS84 ellipsoid; {}", panorama.exposure,
                  static_cast<double>(count_ns(panorama.time) / 1000) * 1e-6,
                  keys.method == "depth" ? "joined by the distances of laser points" : "joined on a sphere");
  tags.taken = to_utc(panorama.time);
  tags.position = panorama.centre;
  tags.sigma_horizontal_m = panorama.sigma_horizontal_m;
  tags.direction = panorama.heading;
  // Viewers turn to the right where columns grow.
  if (keys.orientation != "head" || is_clockwise)
    tags.panorama = storage::PanoramaPose{panorama.heading, panorama.pitch, panorama.roll};
  return tags;
}

int panorama(PanoramaOptions& options) {
  options.drive.check();
  options.given.read(group_of(options.keys));
  const auto config = configuration(options);
  std::optional<Following> following;
  if (options.follows) options.drive.follows = following.emplace().asked();
  ProgressBar bar(!following || isatty(STDERR_FILENO) != 0);
  auto source = DriveSource::open(options.drive, bar);
  bar.end();
  if (!source.ok()) {
    log_error(source.error().message);
    return opening_status(source.error());
  }
  const auto& head = source->rig.geometry.head;
  if (head.lenses.empty()) throw config::ConfigError("the rig has no camera head: there are no images to join");
  const auto trajectory = open_trajectory(options.trajectory, options.drive, bar);
  bar.end();
  if (!trajectory.ok()) {
    log_error(trajectory.error().message);
    return opening_status(trajectory.error());
  }
  auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) {
    log_error(folder.error().message);
    return kOutputRefused;
  }
  PanoramaTables tables(source->rig);
  Status written;
  const auto use = [&](survey::DrivePanorama&& one) {
    const auto& picture = one.rendered.picture;
    const storage::RgbPixels pixels{picture.pixels.data(), static_cast<int>(picture.width),
                                    static_cast<int>(picture.height)};
    const auto tags = tags_of(one, options.keys, head.panorama.is_clockwise);
    const bool is_png = options.keys.format == "png";
    const auto encoded =
        is_png ? storage::encode_png(pixels, tags) : storage::encode_jpeg(pixels, options.keys.quality, tags);
    const std::string name = fmt::format("panorama_{:06}.{}", one.exposure, is_png ? "png" : "jpg");
    written = encoded.ok() ? write_output(folder->path() / name, *encoded) : Status(encoded.error());
    if (written.ok()) written = tables.add(one, name, one.is_level || head.panorama.is_clockwise);
    return written.ok() && !(following && following->asked().stop_requested());
  };
  survey::DrivePanoramas making(source->rig, config, use);
  Status fed =
      source->feed_without_colours(bar, source->rig, making, trajectory->get(), [&] { return making.wants_more(); });
  making.finish();
  bar.end();
  if (*trajectory) {
    std::fputs((*trajectory)->comparison().text().c_str(), stdout);
    if (fed.ok()) fed = (*trajectory)->status();
  }
  if (written.ok()) written = tables.write(folder->path());
  if (!written.ok()) {
    log_error(written.error().message);
    return written.error().code == ErrorCode::Invalid ? kWrongUse : kOutputRefused;
  }
  if (!fed.ok()) log_warning(fed.error().message);
  const auto& counts = making.counts();
  std::fputs(fmt::format("{} panoramas of {} x {} in {}; the drive has {} moments, {} were chosen\n", counts.made,
                         making.width(), making.width() / 2, options.out, counts.moments, counts.chosen)
                 .c_str(),
             stdout);
  if (counts.without_pose) log_warning("{} chosen moments have no pose: no panorama", counts.without_pose);
  if (counts.without_time) log_warning("{} exposures have no time: not used", counts.without_time);
  if (counts.incomplete) log_warning("{} images lack parts: not used", counts.incomplete);
  if (counts.early)
    log_warning("{} panoramas did not wait for all laser points around them, because too many images waited",
                counts.early);
  const bool is_missed = following && Following::tell_missed(*source->recording);
  const auto missing = making.missing_number();
  if (missing && written.ok()) log_error("the drive has no exposure {}", *missing);
  if (counts.made == 0 || missing) return kNothingCame;
  return fed.ok() && !is_missed ? kDone : kInputUnreadable;
}

}  // namespace

void add_panorama(Command& all) {
  auto options = std::make_shared<PanoramaOptions>();
  Command command = all.command(kPanorama.word, kPanorama.help);
  options->drive.declare(command, {.recording = "RECORDING",
                                   .recording_help = "drive.mcap, or the folder of a drive",
                                   .rig_help = "calibrated rig; default: the rig of the recording"});
  options->trajectory.declare(command);
  command.required("--out", options->out, "folder for the panoramas and panoramas.csv");
  options->given.declare(command, group_of(options->keys));
  command.option("--from", options->from_s, "only exposures from this GPS time on, s");
  command.option("--to", options->to_s, "only exposures up to this GPS time, s");
  Following::declare(command, options->follows);
  command.excludes("--follow", "--scenario").excludes("--follow", "--trajectory");
  command.setting("--threads", options->threads, "number of threads; the pictures do not depend on it",
                  {.least = 1, .most = 64});
  command.writes_into(options->out);
  command.footer(
      "Example: hueline panorama drives/today --exposures every:10 --out panoramas\n"
      "Exit status: 0; 3 if the recording could be read only in part; 5 if an exposure is not there, or none was "
      "made.\n"
      "More: docs/panorama.md");
  command.runs([options] { return panorama(*options); });
}

}  // namespace hueline::apps
