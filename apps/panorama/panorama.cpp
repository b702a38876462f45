#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/panorama/import_tables.hpp"
#include "apps/simulate/drive_source.hpp"
#include "apps/simulate/drive_trajectory.hpp"
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
  std::string out, exposures = "all", size, method = "depth", orientation = "heading", blend = "bands", gains = "even",
                   vehicle = "fill", fill = "64,64,64", format = "jpeg";
  double from_s = std::nan(""), to_s = std::nan(""), around_s = 4;
  int quality = 92, threads = 2;
};

/// Reads numbers that `separator` divides. Returns nothing if there are more or fewer than `count`.
std::vector<std::uint32_t> numbers(const std::string& text, char separator, std::size_t count) {
  std::vector<std::uint32_t> out;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    std::uint32_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{}) return {};
    out.push_back(value);
    if (next == end) return out.size() == count ? out : std::vector<std::uint32_t>{};
    if (*next != separator) return {};
    at = next + 1;
  }
}

std::uint32_t width_of(const std::string& size) {
  constexpr std::uint32_t kLeast = 64, kMost = 16384;
  if (size.empty()) return 0;
  const auto sides = numbers(size, 'x', 2);
  if (sides.empty() || sides[0] != 2 * sides[1] || sides[0] < kLeast || sides[0] > kMost || sides[0] % 4 != 0)
    throw config::ConfigError(
        fmt::format("--size {}: give WIDTHxHEIGHT such as 8192x4096; the width is twice the height, "
                    "{} to {} and divisible by 4",
                    size, kLeast, kMost));
  return sides[0];
}

survey::DrivePanoramas::Config configuration(const PanoramaOptions& options) {
  survey::DrivePanoramas::Config config;
  auto choice = runtime::ExposureChoice::parse(options.exposures);
  if (!choice.ok()) throw config::ConfigError("--exposures: " + choice.error().message);
  config.choice = *choice;
  if (Status limited = config.choice.limit(options.from_s, options.to_s); !limited.ok())
    throw config::ConfigError(limited.error().message);
  config.width = width_of(options.size);
  using survey::PanoramaOrientation;
  config.orientation = options.orientation == "north"  ? PanoramaOrientation::North
                       : options.orientation == "head" ? PanoramaOrientation::Head
                                                       : PanoramaOrientation::Heading;
  config.use_depth = options.method == "depth";
  config.around = from_seconds(options.around_s);
  config.threads = options.threads;
  config.rendering.blend = options.blend == "none" ? fusion::PanoramaBlend::None : fusion::PanoramaBlend::Bands;
  config.rendering.even_gains = options.gains == "even";
  config.rendering.hide_vehicle = options.vehicle != "show";
  config.fill_hole = options.vehicle == "fill";
  const auto fill = numbers(options.fill, ',', 3);
  if (fill.empty() || *std::max_element(fill.begin(), fill.end()) > 255)
    throw config::ConfigError("--fill " + options.fill + ": give red, green and blue from 0 to 255, such as 64,64,64");
  for (std::size_t c = 0; c < 3; ++c) config.rendering.fill[c] = static_cast<std::uint8_t>(fill[c]);
  return config;
}

storage::PhotoTags tags_of(const survey::DrivePanorama& panorama, const PanoramaOptions& options, bool is_clockwise) {
  storage::PhotoTags tags;
  tags.software = std::string("hueline ") + runtime::kVersion;
  tags.description =
      fmt::format("exposure {}, GPS time {:.6f} s; altitude above the WGS84 ellipsoid; {}", panorama.exposure,
                  static_cast<double>(count_ns(panorama.time) / 1000) * 1e-6,
                  options.method == "depth" ? "joined by the distances of laser points" : "joined on a sphere");
  tags.taken = to_utc(panorama.time);
  tags.position = panorama.centre;
  tags.sigma_horizontal_m = panorama.sigma_horizontal_m;
  tags.direction = panorama.heading;
  // Viewers turn to the right where columns grow.
  if (options.orientation != "head" || is_clockwise)
    tags.panorama = storage::PanoramaPose{panorama.heading, panorama.pitch, panorama.roll};
  return tags;
}

int panorama(const PanoramaOptions& options) {
  options.drive.check();
  const auto config = configuration(options);
  ProgressBar bar;
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
    const auto tags = tags_of(one, options, head.panorama.is_clockwise);
    const bool is_png = options.format == "png";
    const auto encoded =
        is_png ? storage::encode_png(pixels, tags) : storage::encode_jpeg(pixels, options.quality, tags);
    const std::string name = fmt::format("panorama_{:06}.{}", one.exposure, is_png ? "png" : "jpg");
    written = encoded.ok() ? write_output(folder->path() / name, *encoded) : Status(encoded.error());
    if (written.ok()) written = tables.add(one, name, one.is_level || head.panorama.is_clockwise);
    return written.ok();
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
  const auto missing = making.missing_number();
  if (missing && written.ok()) log_error("the drive has no exposure {}", *missing);
  if (counts.made == 0 || missing) return kNothingCame;
  return fed.ok() ? kDone : kInputUnreadable;
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
  command.setting("--exposures", options->exposures, "all, every:N, or numbers and ranges such as 3,7,20-30");
  command.option("--from", options->from_s, "only exposures from this GPS time on, s");
  command.option("--to", options->to_s, "only exposures up to this GPS time, s");
  command.option("--size", options->size, "WIDTHxHEIGHT in pixels; default: what the lenses resolve");
  command.setting("--method", options->method,
                  "where a lens is sampled: at the distance of the laser points, or on the rig's stitching sphere",
                  {"depth", "sphere"});
  command.setting("--orientation", options->orientation,
                  "level with the head's direction in the middle, level with north in the middle, or the head's own "
                  "axes",
                  {"heading", "north", "head"});
  command.setting("--blend", options->blend, "how lenses meet: in bands, or abruptly", {"bands", "none"});
  command.setting("--gains", options->gains, "brightness of the lenses: made even where they overlap, or as it is",
                  {"even", "raw"});
  command.setting(
      "--vehicle", options->vehicle,
      "what the vehicle hides and the hole below: filled from exposures near by, hidden, or the vehicle is shown",
      {"fill", "hide", "show"});
  command.setting("--fill", options->fill, "colour of what no lens shows: red,green,blue");
  command.setting("--around-s", options->around_s, "laser points within this time before and after are used",
                  {.least = 0.05, .most = 60});
  command.setting("--format", options->format, "format of the pictures", {"jpeg", "png"});
  command.setting("--quality", options->quality, "quality of JPEG pictures", {.least = 1, .most = 100});
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
