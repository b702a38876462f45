#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "config/mounting.hpp"
#include "config/rig_head.hpp"
#include "core/calendar.hpp"
#include "fusion/single_shot.hpp"
#include "storage/las_writer.hpp"
#include "storage/pcd_reader.hpp"
#include "storage/png.hpp"

namespace hueline::apps {
namespace {

struct Options {
  std::string image, cloud, out;
  std::vector<std::string> calibration;
};

/// What one image and one cloud need: a lens, and where the laser is seen from it.
struct Calibration {
  std::optional<fusion::CameraIntrinsics> intrinsics;
  std::optional<Transform<Lens, Scanner>> T_lens_scanner;
};

std::vector<double> flat(const nlohmann::json& matrix) {
  std::vector<double> out;
  for (const auto& row : matrix.at("data"))
    for (const auto& value : row) out.push_back(value.get<double>());
  return out;
}

/// SensorsCalibration's JSON: an object with one member, whose `param` holds cam_K and cam_dist (k1 k2 p1 p2 [k3]) or sensor_calib,
/// the 4 x 4 matrix from the laser's frame to the camera's.
void read_json(const std::string& path, Calibration& out) {
  std::ifstream in(path);
  try {
    const auto root = nlohmann::json::parse(in);
    for (const auto& [name, sensor] : root.items()) {
      const auto& param = sensor.at("param");
      if (param.contains("cam_K")) {
        const auto K = flat(param.at("cam_K"));
        const auto k = flat(param.at("cam_dist"));
        if (K.size() != 9 || k.size() < 4 || k.size() > 5) throw config::ConfigError(path + ": cam_K needs 9 numbers, cam_dist 4 or 5");
        fusion::CameraIntrinsics lens;
        lens.model = fusion::LensModel::Brown;
        lens.focal_px = {K[0], K[4]};
        lens.principal_point_px = {K[2], K[5]};
        std::copy(k.begin(), k.end(), lens.distortion.begin());
        out.intrinsics = lens;
      }
      if (param.contains("sensor_calib")) {
        const auto T = flat(param.at("sensor_calib"));
        if (T.size() != 16) throw config::ConfigError(path + ": sensor_calib needs 16 numbers");
        Eigen::Matrix3d R;
        R << T[0], T[1], T[2], T[4], T[5], T[6], T[8], T[9], T[10];
        if (!(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-3))
          throw config::ConfigError(path + ": the rotation of sensor_calib is not one: its rows are not orthonormal within 0.001");
        out.T_lens_scanner = Transform<Lens, Scanner>{Eigen::Quaterniond(R).normalized(), {T[3], T[7], T[11]}};
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw config::ConfigError(fmt::format("{}: {}", path, e.what()));
  }
}

/// Ours: `lens:` as in a rig, `T_lens_scanner:` a mounting; either or both.
void read_yaml(const std::string& path, Calibration& out) {
  config::Section root = config::Section::load_file(path);
  if (root.has("lens")) {
    config::Section lens = root.section("lens");
    out.intrinsics = config::read_intrinsics(lens);
    lens.finish();
  }
  if (root.has("T_lens_scanner")) out.T_lens_scanner = config::read_transform<Lens, Scanner>(root, "T_lens_scanner");
  root.finish();
}

/// LAS wants a place on Earth, and a shot has none. Where the equator meets Greenwich, World Mercator has scale 1 and no convergence: there
/// the file's x, y, z are the scanner's own (z but for the Earth's curvature, 1 mm at 100 m).
constexpr int kNowhere = 3395;
constexpr const char* kNowhereNote = "x, y, z of cloud.las are the laser's own; its CRS (EPSG:3395 at 0 N 0 E) only stands for a place that is not known\n";

/// The shot as a cloud of its own: x east, y north, z up of the scanner.
CloudBlock cloud_of(const std::vector<Point<Scanner>>& points, const std::vector<fusion::ShotPoint>& shot) {
  CloudBlock block;
  block.origin = {0, 0, 0};
  for (std::size_t i = 0; i < points.size(); ++i) {
    ColouredPoint p;
    p.east = points[i].xyz.x();
    p.north = points[i].xyz.y();
    p.up = points[i].xyz.z();
    p.u = shot[i].u;
    p.v = shot[i].v;
    p.state = shot[i].state;
    if (p.state == ColourState::Direct) {
      p.red = shot[i].red;
      p.green = shot[i].green;
      p.blue = shot[i].blue;
      p.exposure = 0;
      p.lens = 0;
      p.quality = 255;
    }
    block.points.push_back(p);
  }
  return block;
}

int colour(const Options& options) {
  Calibration calibration;
  for (const auto& path : options.calibration) {
    if (!std::filesystem::exists(path)) throw config::ConfigError(path + ": is not there");
    path.ends_with(".json") ? read_json(path, calibration) : read_yaml(path, calibration);
  }
  if (!calibration.intrinsics) throw config::ConfigError("no calibration file holds a lens (cam_K, or our lens:)");
  if (!calibration.T_lens_scanner) throw config::ConfigError("no calibration file says where the laser is (sensor_calib, or our T_lens_scanner:)");
  const auto image = storage::read_png(options.image);
  const auto cloud = storage::read_pcd(options.cloud);
  if (!image.ok() || !cloud.ok()) {
    log_error(!image.ok() ? image.error().message : cloud.error().message);
    return kInputUnreadable;
  }
  const auto x = cloud->column("x"), y = cloud->column("y"), z = cloud->column("z");
  if (x.empty() || y.empty() || z.empty()) {
    log_error("{}: has no fields x, y, z", options.cloud);
    return kInputUnreadable;
  }
  std::vector<Point<Scanner>> points;
  std::size_t without_place = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]))
      points.push_back({{x[i], y[i], z[i]}});
    else
      ++without_place;
  }
  calibration.intrinsics->width = static_cast<std::uint32_t>(image->width);
  calibration.intrinsics->height = static_cast<std::uint32_t>(image->height);
  if (const std::string wrong = calibration.intrinsics->validate(); !wrong.empty()) throw config::ConfigError(wrong);
  const fusion::RawView view{reinterpret_cast<const std::uint8_t*>(image->pixels.data()), std::size_t{3} * calibration.intrinsics->width,
                             calibration.intrinsics->width, calibration.intrinsics->height, PixelFormat::Rgb8};
  const auto shot = fusion::colour_single_shot(points, *calibration.T_lens_scanner, fusion::CameraModel(*calibration.intrinsics), view, {});

  std::filesystem::create_directories(options.out);
  const auto las_path = std::filesystem::path(options.out) / "cloud.las";
  const auto png_path = std::filesystem::path(options.out) / "overlay.png";
  const CloudBlock block = cloud_of(points, shot);
  storage::LasWriter::Config in_laser_frame;
  in_laser_frame.epsg = kNowhere;
  auto las = storage::LasWriter::create(las_path, block.origin, in_laser_frame);
  Status done = las.ok() ? las->append(block) : Status(las.error());
  if (done.ok()) done = las->close();
  const fusion::RgbRaster raster = fusion::draw_points(shot, view, {});
  storage::RgbImage drawn(static_cast<int>(raster.width), static_cast<int>(raster.height), {});
  for (std::size_t i = 0; i < drawn.pixels.size(); ++i) drawn.pixels[i] = {raster.pixels[3 * i], raster.pixels[3 * i + 1], raster.pixels[3 * i + 2]};
  if (done.ok()) done = storage::write_png(png_path, drawn);
  if (!done.ok()) {
    log_error(done.error().message);
    return kOutputRefused;
  }
  std::size_t coloured = 0, hidden = 0;
  for (const auto& p : shot) coloured += p.state == ColourState::Direct, hidden += p.is_in_image && p.is_hidden;
  std::fputs(fmt::format("{} points, {} coloured, {} hidden behind nearer ones, {} outside the image, {} without a place\n{}\n{}\n", points.size() + without_place,
                         coloured, hidden, points.size() - coloured - hidden, without_place, las_path.string(), png_path.string())
                 .c_str(),
             stdout);
  std::fputs(kNowhereNote, stdout);
  return coloured ? kDone : kNothingCame;
}

}  // namespace

void add_colour(Command& all) {
  auto options = std::make_shared<Options>();
  Command command = all.command("colour", "colour one laser cloud from one image of the same moment, and draw the points over the image");
  command.required("IMAGE", options->image, "PNG");
  command.required("CLOUD", options->cloud, "PCD in the laser's frame");
  command.required("CALIBRATION", options->calibration, "lens and laser-to-camera transform: SensorsCalibration JSON files, or YAML with lens: and T_lens_scanner:");
  command.required("--out", options->out, "folder for cloud.las and overlay.png");
  command.runs([options] { return colour(*options); });
}

}  // namespace hueline::apps
