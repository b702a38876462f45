#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/calibrate/calibrate.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/progress_bar.hpp"
#include "apps/simulate/drive_source.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"
#include "fusion/pixel_mask.hpp"
#include "sim/rig_truth.hpp"
#include "storage/png.hpp"
#include "survey/vehicle_masks.hpp"

namespace hueline::apps {
namespace {

using Mask = calibration::VehicleMask;

struct CalibrateMaskOptions {
  DriveOptions drive;
  std::string out;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

double vehicle_share(const Mask::Found& found) {
  return static_cast<double>(std::ranges::count(found.vehicle, true)) / static_cast<double>(found.vehicle.size());
}

std::string said_of(const std::string& lens, const Mask::Found& found) {
  const auto unknown = std::ranges::count(found.cells, Mask::Cell::Unknown);
  const std::string decided =
      fmt::format("{} views, {} pixels compared, {:.0f} % of the image decided by them", found.views, found.compared,
                  100 - 100 * static_cast<double>(unknown) / static_cast<double>(found.cells.size()));
  if (!found.is_determined) return fmt::format("lens '{}': NOT determined ({})\n", lens, decided);
  return fmt::format("lens '{}': the vehicle is {:.1f} % of the image ({})\n", lens, 100 * vehicle_share(found),
                     decided);
}

/// Compares with the vehicle of the simulator.
std::string against_truth(const sim::RigTruth& truth, std::size_t lens, const fusion::LensMount& mount,
                          const Mask::Found& found) {
  const auto width = mount.intrinsics.width, height = mount.intrinsics.height;
  const fusion::PixelMask learnt(found.polygons, width, height, 0);
  const std::vector<std::uint8_t> vehicle = truth.own_vehicle_mask(lens);
  std::size_t missed = 0, too_much = 0, all = 0;
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const bool is_vehicle = vehicle[static_cast<std::size_t>(y) * width + x] != 0, is_masked = learnt.covers(x, y);
      all += is_vehicle;
      missed += is_vehicle && !is_masked;
      too_much += !is_vehicle && is_masked;
    }
  const double pixels = static_cast<double>(width) * static_cast<double>(height);
  return fmt::format(
      "  against the simulator's truth: the vehicle is {:.2f} % of the image, {:.2f} % are missing in the mask, {:.2f} "
      "% are too much\n",
      100 * static_cast<double>(all) / pixels, 100 * static_cast<double>(missed) / pixels,
      100 * static_cast<double>(too_much) / pixels);
}

std::string masks_yaml(const std::string& lens, const Mask::Found& found) {
  std::string out = fmt::format("# Of the lens {}, learnt by hueline calibrate mask from {} images.\n{}\n", lens,
                                found.views, found.polygons.empty() ? "masks: []" : "masks:  # the vehicle itself");
  for (const auto& polygon : found.polygons) {
    std::string corners;
    for (const auto& corner : polygon)
      corners += fmt::format("{}{:.2f}, {:.2f}", corners.empty() ? "" : ", ", corner.x(), corner.y());
    out += fmt::format("  - polygon_px: [{}]\n", corners);
  }
  return out;
}

/// Draws what the lens showed on average, the vehicle in red, and darker what no view decided.
storage::RgbImage picture_of(const Mask::Found& found) {
  storage::RgbImage out(found.columns, found.rows, {0, 0, 0});
  for (std::size_t i = 0; i < out.pixels.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      out.pixels[i][k] =
          static_cast<std::uint8_t>(found.cells[i] == Mask::Cell::Unknown ? found.mean[i][k] / 2 : found.mean[i][k]);
    if (found.vehicle[i]) out.pixels[i][0] = static_cast<std::uint8_t>(128 + out.pixels[i][0] / 2);
  }
  return out;
}

Status write_lens(const std::filesystem::path& folder, const std::string& lens, const Mask::Found& found) {
  const auto stem = folder / ("masks_" + lens);
  if (Status written = storage::write_png(stem.string() + ".png", picture_of(found)); !written.ok()) return written;
  if (!found.is_determined) return {};
  if (Status written = write_output(stem.string() + ".yaml", masks_yaml(lens, found)); !written.ok()) return written;
  std::fputs((stem.string() + ".yaml\n").c_str(), stdout);
  return {};
}

Status write_masks(const std::string& out, const std::vector<fusion::LensMount>& lenses,
                   const std::vector<Mask::Found>& found) {
  const auto folder = OutputFolder::open(out);
  if (!folder.ok()) return folder.error();
  for (std::size_t i = 0; i < found.size(); ++i)
    if (Status written = write_lens(folder->path(), lenses[i].name, found[i]); !written.ok()) return written;
  return {};
}

int calibrate(const CalibrateMaskOptions& options) {
  options.drive.check();
  ProgressBar bar;
  auto source = DriveSource::open(options.drive, bar);
  bar.end();
  if (!source.ok()) {
    log_error(source.error().message);
    return opening_status(source.error());
  }
  const auto& lenses = source->rig.geometry.head.lenses;
  if (source->rig.geometry.lasers.empty() || lenses.empty())
    throw config::ConfigError("the rig has no laser scanner or no lens: the vehicle is learnt from both");
  std::vector<Mask::Found> found(lenses.size());
  Status fed;
  for (const survey::MaskPass& pass : survey::mask_passes(source->rig.geometry)) {
    survey::VehicleMasks masks(source->rig.colouring, survey::rig_of_pass(source->rig.geometry, pass, found),
                               options.threads);
    fed = source->feed_without_colours(bar, source->rig, masks);
    const std::vector<Mask::Found> of_pass = masks.finish();
    for (std::size_t i = 0; i < found.size(); ++i)
      if (pass.is_judged[i]) found[i] = of_pass[i];
  }
  bar.end();
  int status = kDone;
  if (!fed.ok()) {
    log_warning(fed.error().message);
    status = kInputUnreadable;
  }
  const auto truth = source->scenario ? std::optional(sim::rig_truth(*source->scenario)) : std::nullopt;
  for (std::size_t i = 0; i < found.size(); ++i) {
    std::fputs(said_of(lenses[i].name, found[i]).c_str(), stdout);
    if (truth) std::fputs(against_truth(*truth, i, lenses[i], found[i]).c_str(), stdout);
    if (!found[i].is_determined) status = kInputUnreadable;
  }
  if (!options.out.empty())
    if (const Status written = write_masks(options.out, lenses, found); !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
  if (std::ranges::none_of(found, [](const Mask::Found& one) { return one.is_determined; })) {
    log_error("no lens has images from {} places more than a metre apart with coloured points in them: drive farther",
              Mask::kFewestViews);
    return kNothingCame;
  }
  return status;
}

}  // namespace

void add_calibrate_mask(Command& calibrate_command) {
  auto options = std::make_shared<CalibrateMaskOptions>();
  Command command =
      calibrate_command.command("mask", "learn from a drive which parts of the lens images are the vehicle itself");
  options->drive.declare(command, {.recording = "--recording",
                                   .recording_help = "drive.mcap of a drive of a minute or more",
                                   .rig_help = "rig with lenses and mountings; default: the rig of the recording"});
  command.setting("--threads", options->threads, "threads of the colouring", {.least = 1, .most = 256});
  command.option(
      "--out", options->out,
      "folder for masks_LENS.yaml, which replaces the key masks of that lens in the rig, and masks_LENS.png");
  command.footer(
      "What stays the same in an image while the world moves is the vehicle. Drive a minute or more through a street\n"
      "with markings, shadows and verges. The masks of the rig are not used. The drive is read three times.\n"
      "Example: hueline calibrate mask --recording drives/today --out masks\n"
      "Exit status: 0; 3 if the recording could be read only in part, or a lens is not determined; 4 if a file cannot "
      "be\nwritten; 5 if no lens is determined.\n"
      "More: docs/calibration.md");
  command.writes_into(options->out);
  command.runs([options] { return calibrate(*options); });
}

}  // namespace hueline::apps
