#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "apps/colour/shot_calibration.hpp"
#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/input_error.hpp"
#include "apps/log.hpp"
#include "config/section.hpp"
#include "core/exif_orientation.hpp"
#include "core/output_file.hpp"
#include "fusion/shot_outlines.hpp"
#include "fusion/single_shot.hpp"
#include "storage/cloud_file.hpp"
#include "storage/cloud_picture.hpp"
#include "storage/image_file.hpp"
#include "storage/photo_file.hpp"
#include "storage/shot_cloud.hpp"

namespace hueline::apps {
namespace {

// The eye of the comparison, from the lens: where the lens's shadows in the cloud show.
constexpr double kEyeAhead_m = 1, kEyeRight_m = 3.5, kEyeUp_m = 4, kEyeTurn = -0.12, kEyePitch = -0.2;
constexpr int kPictureWidth_px = 560, kPictureHeight_px = 300, kPictureGap_px = 8, kJpegQuality = 75;
constexpr double kPictureView = 1.0;    // width of the view, rad
constexpr double kSplat_share = 0.005;  // radius of a point, of its distance
constexpr double kLeastReach_px = 8;    // within which something nearer is looked for

struct ColourOptions {
  std::string image, cloud, out, image_size = "refuse", image_turn = "auto", visibility = "on";
  bool compare = false;
  std::vector<std::string> calibration;
};

/// Returns what a user must know about the written file.
std::string notes_text(const storage::ShotCloudNotes& notes) {
  std::string out =
      fmt::format("x, y, z of cloud.las are the cloud's own, in steps of {:g} m; it has no CRS\n", notes.step_m);
  if (notes.offset_m != std::array<double, 3>{})
    out +=
        fmt::format("its offset is {:.0f} {:.0f} {:.0f} m\n", notes.offset_m[0], notes.offset_m[1], notes.offset_m[2]);
  out += notes.intensity_field.empty() ? std::string("the cloud has no field intensity\n")
                                       : fmt::format("its intensity is the cloud's {} times {:g}\n",
                                                     notes.intensity_field, notes.intensity_scale);
  if (!notes.time_field.empty())
    out += fmt::format("its GPS time is the cloud's {} as it stands: unit and epoch are those of the cloud\n",
                       notes.time_field);
  return out;
}

/// The points that the cloud has a place for, and their colours; both have the same order.
struct PlacedPoints {
  std::vector<Point<Scanner>> points;
  std::vector<storage::ShotColour> colours;
};

/// Returns the points of the cloud, without colours yet. Error: Malformed if a field is missing.
Result<PlacedPoints> placed_points(const storage::PcdCloud& cloud, const std::string& file) {
  const auto x = cloud.column("x"), y = cloud.column("y"), z = cloud.column("z");
  if (x.empty() || y.empty() || z.empty())
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: x, y and z are needed; its fields: {}", file, fmt::join(cloud.fields, ", "))};
  PlacedPoints out;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i]) || !std::isfinite(z[i])) continue;
    out.points.push_back({{x[i], y[i], z[i]}});
    out.colours.push_back({.row = i});
  }
  return out;
}

/// Writes what was found for each point into its colour.
void set_colours(const std::vector<fusion::ShotPoint>& shot, std::vector<storage::ShotColour>& colours) {
  for (std::size_t i = 0; i < shot.size(); ++i) {
    storage::ShotColour& out = colours[i];
    out.state = shot[i].state;
    if (shot[i].is_in_image) out.u = shot[i].u, out.v = shot[i].v;
    if (shot[i].state == ColourState::Direct) out.red = shot[i].red, out.green = shot[i].green, out.blue = shot[i].blue;
  }
}

/// Draws the points over the image and writes the picture.
Status write_overlay(const std::filesystem::path& path, const std::vector<fusion::ShotPoint>& shot,
                     const fusion::RawView& view) {
  const fusion::RgbRaster raster = fusion::draw_points(shot, view, {});
  storage::RgbImage drawn(static_cast<int>(raster.width), static_cast<int>(raster.height), {});
  for (std::size_t i = 0; i < drawn.pixels.size(); ++i)
    drawn.pixels[i] = {raster.pixels[3 * i], raster.pixels[3 * i + 1], raster.pixels[3 * i + 2]};
  return storage::write_png(path, drawn);
}

/// Returns what can be said about wrong colours without truth.
std::string outline_text(const std::vector<Point<Scanner>>& points, const std::vector<fusion::ShotPoint>& untested,
                         const std::vector<fusion::ShotPoint>& tested) {
  const double gap = fusion::ring_gap_px(untested);
  const auto figures = fusion::judge_outlines(points, untested, tested, std::max(kLeastReach_px, gap));
  if (figures.all.judged == 0) return "no point lies behind an outline whose two sides differ in colour\n";
  const auto text = [](const fusion::OutlineShare& share) {
    return fmt::format("{:.1f} % of {}", 100 * share.share(), share.judged);
  };
  return fmt::format(
      "rings are {:.1f} px apart; of the points behind outlines whose sides differ in colour, {} have the nearer "
      "side's: {} that the test of visibility keeps, {} that it refuses\n",
      gap, text(figures.all), text(figures.kept), text(figures.refused));
}

/// Draws the cloud in the colours of each of two shots, side by side, as seen from above and behind the lens, where
/// what is hidden from the lens shows. Points without a colour are grey.
Status write_comparison(const std::filesystem::path& path, const storage::PcdCloud& cloud,
                        std::vector<storage::ShotColour> colours, const Transform<Lens, Scanner>& T_lens_scanner,
                        const std::array<std::vector<fusion::ShotPoint>, 2>& shots) {
  const auto T_scanner_lens = T_lens_scanner.inverse();
  const Eigen::Vector3d ahead = T_scanner_lens.rotation * Eigen::Vector3d::UnitZ();
  storage::StreetViewConfig view;
  view.heading = std::atan2(ahead.x(), ahead.y());
  const Eigen::Vector3d level(std::sin(view.heading), std::cos(view.heading), 0), right(level.y(), -level.x(), 0);
  view.position =
      T_scanner_lens.translation + kEyeAhead_m * level + kEyeRight_m * right + kEyeUp_m * Eigen::Vector3d::UnitZ();
  view.heading += kEyeTurn;
  view.pitch = kEyePitch;
  view.horizontal_view = kPictureView;
  view.width = kPictureWidth_px;
  view.height = kPictureHeight_px;
  view.splat_share = kSplat_share;
  storage::RgbImage both(2 * kPictureWidth_px + kPictureGap_px, kPictureHeight_px, {255, 255, 255});
  for (std::size_t i = 0; i < shots.size(); ++i) {
    set_colours(shots[i], colours);
    const auto las = path.parent_path() / (i == 0 ? "untested.las" : "tested.las");
    if (const auto written = storage::write_shot_cloud(las, cloud, colours); !written.ok()) return written.error();
    const auto drawn = storage::picture_from_street(las, view);
    std::error_code ignored;
    std::filesystem::remove(las, ignored);
    if (!drawn.ok()) return drawn.error();
    const int left = static_cast<int>(i) * (kPictureWidth_px + kPictureGap_px);
    for (int y = 0; y < kPictureHeight_px; ++y)
      for (int x = 0; x < kPictureWidth_px; ++x) both.at(left + x, y) = drawn->image.at(x, y);
  }
  const auto jpeg = storage::encode_jpeg({both.pixels[0].data(), both.width, both.height}, kJpegQuality, {});
  if (!jpeg.ok()) return jpeg.error();
  return write_output(path, *jpeg);
}

int colour(const ColourOptions& options) {
  const ShotCalibration calibration = read_shot_calibration(options.calibration);
  if (!calibration.intrinsics)
    throw InputError("no calibration file holds a lens: lens: of hueline, or one that docs/colour.md lists");
  if (!calibration.T_lens_scanner)
    throw InputError(
        "no calibration file says where the laser is: T_lens_scanner: of hueline, or a pose that docs/colour.md lists");
  auto stored = storage::read_image(options.image);
  const auto cloud = storage::read_cloud(options.cloud);
  if (!stored.ok() || !cloud.ok()) {
    log_error(!stored.ok() ? stored.error().message : cloud.error().message);
    return kInputUnreadable;
  }
  auto placed = placed_points(*cloud, options.cloud);
  if (!placed.ok()) {
    log_error(placed.error().message);
    return kInputUnreadable;
  }
  storage::RgbImage& image = stored->image;
  if (is_turned(*calibration.intrinsics, calibration.lens_file, image.width, image.height, stored->orientation,
                options.image, image_turn(options.image_turn)))
    turn_as_shown(stored->orientation, image.width, image.height, image.pixels);
  const fusion::CameraIntrinsics lens = fit_to_image(*calibration.intrinsics, calibration.lens_file, image.width,
                                                     image.height, options.image, other_size(options.image_size));
  const fusion::RawView view{reinterpret_cast<const std::uint8_t*>(image.pixels.data()), std::size_t{3} * lens.width,
                             lens.width, lens.height, PixelFormat::Rgb8};
  const fusion::CameraModel model(lens);
  const auto tested = fusion::colour_single_shot(placed->points, *calibration.T_lens_scanner, model, view, {});
  const auto untested =
      fusion::colour_single_shot(placed->points, *calibration.T_lens_scanner, model, view, {.test_visibility = false});
  const auto& shot = options.visibility == "on" ? tested : untested;
  set_colours(shot, placed->colours);

  const auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) {
    log_error(folder.error().message);
    return kOutputRefused;
  }
  const auto las_path = std::filesystem::path(options.out) / "cloud.las";
  const auto png_path = std::filesystem::path(options.out) / "overlay.png";
  const auto written = storage::write_shot_cloud(las_path, *cloud, placed->colours);
  Status done = written.ok() ? Status() : Status(written.error());
  if (done.ok()) done = write_overlay(png_path, shot, view);
  const auto jpg_path = std::filesystem::path(options.out) / "compare.jpg";
  if (done.ok() && options.compare)
    done = write_comparison(jpg_path, *cloud, placed->colours, *calibration.T_lens_scanner, {untested, tested});
  if (!done.ok()) {
    log_error(done.error().message);
    return kOutputRefused;
  }
  const auto coloured = std::ranges::count(shot, ColourState::Direct, &fusion::ShotPoint::state);
  const auto hidden = std::ranges::count_if(shot, [](const auto& p) { return p.is_in_image && p.is_hidden; });
  std::fputs(fmt::format("{} points, {} coloured, {} hidden behind nearer ones, {} outside the image, {} without a "
                         "place left out\n{}\n{}\n",
                         cloud->points(), coloured, hidden, std::ssize(placed->points) - coloured - hidden,
                         cloud->points() - placed->points.size(), las_path.string(), png_path.string())
                 .c_str(),
             stdout);
  if (options.compare) std::fputs((jpg_path.string() + "\n").c_str(), stdout);
  std::fputs((calibration.lens_note + calibration.pose_note + notes_text(*written)).c_str(), stdout);
  std::fputs(outline_text(placed->points, untested, tested).c_str(), stdout);
  if (coloured == 0)
    log_error(
        "no point lies in the image: check that the calibration belongs to this image and this laser, and that T leads "
        "from laser to lens");
  return coloured ? kDone : kNothingCame;
}

}  // namespace

void add_colour(Command& all) {
  auto options = std::make_shared<ColourOptions>();
  Command command = all.command(
      "colour", "colour one laser cloud from one image of the same moment, and draw the points over the image");
  command.required("IMAGE", options->image, "image file, PNG or JPEG");
  command.required(
      "CLOUD", options->cloud,
      "points in the laser's frame: PCD, PLY, E57, LAS, rows of float32 of KITTI and nuScenes (.bin), or NumPy (.npy)");
  command.required("CALIBRATION", options->calibration,
                   "files with the lens and the pose of the laser: YAML with lens: and T_lens_scanner:, or files of "
                   "ROS, OpenCV, Autoware, Kalibr, KITTI, SensorsCalibration and others (docs/colour.md)");
  command.setting("--image-size", options->image_size, kImageSizeHelp, kImageSizeWords);
  command.setting("--image-turn", options->image_turn, kImageTurnHelp, kImageTurnWords);
  command.setting("--visibility", options->visibility,
                  "on: points behind nearer ones get no colour; off: every point in the image gets one", {"on", "off"});
  command.flag(
      "--compare", options->compare,
      "write compare.jpg, too: the cloud without (left) and with the test of visibility, from beside the lens");
  command.required("--out", options->out, "folder for cloud.las and overlay.png");
  command.reads(options->image).reads(options->cloud).reads(options->calibration).writes_into(options->out);
  command.footer(
      "Example: hueline colour shot.jpg shot.pcd calibration.yaml --out coloured\n"
      "Exit status: 0; 3 if an input cannot be read; 5 if no point is in the image.\n"
      "More: docs/colour.md");
  command.runs([options] { return colour(*options); });
}

}  // namespace hueline::apps
