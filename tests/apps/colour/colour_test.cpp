#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "storage/las_reader.hpp"
#include "storage/pcd_reader.hpp"
#include "storage/png.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/test_data.hpp"

/// Runs `hueline colour` on a real image and the laser cloud of the same moment. Whether the two coincide is judged by
/// data that the projection does not use: where the laser sees a depth edge, where it sees sky behind, and how strongly
/// the road reflects.
namespace hueline::apps {
namespace {
using namespace hueline::test;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct CloudPoint {
  Eigen::Vector3d xyz;
  double range = 0, azimuth_deg = 0, intensity = 0;
  bool is_edge = false;  // the near side of a jump between neighbours in a ring
};

/// The rings of the scanner are at least 0.15 degrees apart, the returns of a ring 0.2 degrees.
std::vector<CloudPoint> read_cloud(const std::filesystem::path& path) {
  const auto cloud = storage::read_pcd(path);
  const auto x = cloud->column("x"), y = cloud->column("y"), z = cloud->column("z"),
             intensity = cloud->column("intensity");
  std::vector<CloudPoint> points;
  std::map<long, std::vector<std::size_t>> rings;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d p(x[i], y[i], z[i]);
    rings[std::lround(std::atan2(p.z(), p.head<2>().norm()) * 180 / M_PI * 20)].push_back(i);
    points.push_back({p, p.norm(), std::atan2(p.y(), p.x()) * 180 / M_PI, intensity[i]});
  }
  for (auto& [elevation, ring] : rings) {
    std::sort(ring.begin(), ring.end(), [&](auto a, auto b) { return points[a].azimuth_deg < points[b].azimuth_deg; });
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
      CloudPoint& point = points[ring[i]];
      for (const CloudPoint* other : {&points[ring[i - 1]], &points[ring[i + 1]]})
        point.is_edge |= point.range > 3 && (std::abs(other->azimuth_deg - point.azimuth_deg) > 0.35 ||
                                             other->range - point.range > std::max(0.5, 0.08 * point.range));
    }
  }
  return points;
}

class Grey {
 public:
  explicit Grey(const storage::RgbImage& image) : width_(image.width) {
    for (const auto& p : image.pixels) values_.push_back(0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]);
  }
  /// Applies [1 2 1] / 4 along rows and columns in each pass.
  void blur(int passes) {
    for (int pass = 0; pass < passes; ++pass)
      for (const int step : {1, width_}) {
        const auto before = values_;
        for (std::size_t i = static_cast<std::size_t>(step); i + static_cast<std::size_t>(step) < values_.size(); ++i)
          values_[i] = (before[i - static_cast<std::size_t>(step)] + 2 * before[i] +
                        before[i + static_cast<std::size_t>(step)]) /
                       4;
      }
  }
  /// Returns how fast the grey value changes along the rows.
  Grey across() const {
    Grey out = *this;
    for (std::size_t i = 1; i + 1 < values_.size(); ++i) out.values_[i] = std::abs(values_[i + 1] - values_[i - 1]) / 2;
    return out;
  }
  double at(double u, double v) const {
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const double fx = u - x, fy = v - y;
    const double* p = &values_[static_cast<std::size_t>(y * width_ + x)];
    return (1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * p[width_] + fx * p[width_ + 1]);
  }
  double row_median(double v) const {
    std::vector<double> row(values_.begin() + static_cast<int>(v) * width_,
                            values_.begin() + (static_cast<int>(v) + 1) * width_);
    std::nth_element(row.begin(), row.begin() + width_ / 2, row.end());
    return row[static_cast<std::size_t>(width_) / 2];
  }

 private:
  int width_;
  std::vector<double> values_;
};

struct Alignment {
  double edges = 0;        ///< mean change of grey across the columns at the laser's depth edges
  double silhouettes = 0;  ///< contrast to the sky at returns above the roofs; 0 if they lie on sky
  double road = 0;         ///< correlation of the road's reflectivity with its brightness (zebra crossing, lane lines)
};

class Coloured {
 public:
  Coloured(const std::filesystem::path& dir, const std::vector<CloudPoint>& cloud) : cloud_(cloud) {
    auto reader = storage::LasReader::open(dir / "cloud.las");
    if (!reader.ok()) throw std::runtime_error(reader.error().message);
    const auto *u = reader->extra_field("image_u"), *v = reader->extra_field("image_v"),
               *state = reader->extra_field("colour_state");
    std::vector<storage::LasPoint> batch;
    while (reader->next(batch).ok() && !batch.empty())
      for (const auto& point : batch) {
        pixels.emplace_back(storage::LasReader::extra(point, *u), storage::LasReader::extra(point, *v));
        is_coloured.push_back(storage::LasReader::extra(point, *state) == 0);
        places.emplace_back(point.x, point.y, point.z);
        colours.push_back({point.red / 257.0, point.green / 257.0, point.blue / 257.0});
      }
  }
  Alignment judge(const Grey& image, const Grey& changes) const {
    Alignment out;
    double edges = 0, edge_count = 0, sky = 0, sky_count = 0;
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    std::map<int, double> medians;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const double u = pixels[i].x(), v = pixels[i].y();
      if (u < 20 || v < 20 || u > 1899 || v > 1179) continue;
      if (cloud_[i].is_edge) edges += std::min(30.0, changes.at(u, v)), ++edge_count;
      if (v < 400) {
        const auto [row, is_new] = medians.try_emplace(static_cast<int>(v));
        if (is_new) row->second = image.row_median(v);
        sky += std::min(1.0, std::abs(image.at(u, v) - row->second) / 40);
        ++sky_count;
      }
      if (cloud_[i].xyz.z() < -1.4 && cloud_[i].range > 6 && cloud_[i].range < 45) {
        const double x = std::min(cloud_[i].intensity, 80.0), y = image.at(u, v);
        ++n, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
      }
    }
    out.edges = edges / edge_count;
    out.silhouettes = sky / sky_count;
    out.road = (ab - a * b / n) / std::sqrt((aa - a * a / n) * (bb - b * b / n));
    return out;
  }

  std::vector<std::array<double, 3>> colours;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> places;
  std::vector<bool> is_coloured;

 private:
  const std::vector<CloudPoint>& cloud_;
};

struct Mount {
  Matrix3 R;
  Eigen::Vector3d t;
};

TEST(Colour, ARealShotCoincidesWithItsImage) {
  HUELINE_REQUIRE_DATA("lidar_camera/0.png");
  const auto folder = data_file.parent_path();
  const std::string lens = folder / "center_camera-intrinsic.json",
                    mount_file = folder / "top_center_lidar-to-center_camera-extrinsic.json";
  TemporaryFolder dir;
  const auto cloud = read_cloud(folder / "0.pcd");
  ASSERT_EQ(cloud.size(), 78238u);
  const auto shoot = [&](const std::string& name, const std::string& mount) {
    const Ran ran =
        run({"colour", data_file, folder / "0.pcd", lens, mount, "--image-size", "same-pixels", "--out", dir / name});
    EXPECT_EQ(ran.status, 0) << ran.said;
    return Coloured(dir / name, cloud);
  };
  const Coloured given = shoot("given", mount_file);

  // The file has every point of the cloud in its order, with the image's colour at the point's pixel.
  const auto image = storage::read_png(data_file);
  ASSERT_EQ(given.colours.size(), cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) ASSERT_LT((given.places[i] - cloud[i].xyz).norm(), 1e-6);
  const auto coloured = static_cast<std::size_t>(std::count(given.is_coloured.begin(), given.is_coloured.end(), true));
  EXPECT_GT(coloured, 8500u);  // of about 9900 that the lens sees
  EXPECT_LT(coloured, 9925u);  // some of these are hidden by others
  const auto overlay = storage::read_png(dir / "given" / "overlay.png");
  ASSERT_TRUE(overlay.ok());
  EXPECT_EQ(overlay->width, 1920);
  EXPECT_EQ(overlay->height, 1200);

  // The lens and the mounting are read a second time, directly from the files.
  const auto lens_json = read_json(lens).begin()->at("param"),
             mount_json = read_json(mount_file).begin()->at("param").at("sensor_calib").at("data");
  const auto& K = lens_json.at("cam_K").at("data");
  const auto k = lens_json.at("cam_dist").at("data").at(0).get<std::vector<double>>();
  Mount mount;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      mount.R(r, c) = mount_json[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)].get<double>();
    mount.t(r) = mount_json[static_cast<std::size_t>(r)][3].get<double>();
  }
  double farthest = 0, strangest = 0;  // px; grey steps of up to 255 outside the four pixels around
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!given.is_coloured[i]) continue;
    const Eigen::Vector3d p = mount.R * cloud[i].xyz + mount.t;
    const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y, radial = 1 + r2 * (k[0] + r2 * k[1]);
    const Eigen::Vector2d pixel(
        (x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x)) * K[0][0].get<double>() + K[0][2].get<double>(),
        (y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y) * K[1][1].get<double>() + K[1][2].get<double>());
    const int column = static_cast<int>(pixel.x()), row = static_cast<int>(pixel.y());
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const auto [low, high] =
          std::minmax({image->at(column, row)[channel], image->at(column + 1, row)[channel],
                       image->at(column, row + 1)[channel], image->at(column + 1, row + 1)[channel]});
      strangest = std::max({strangest, low - given.colours[i][channel], given.colours[i][channel] - high});
    }
    farthest = std::max(farthest, (pixel - given.pixels[i]).norm());
  }
  std::printf("%zu of %zu points coloured; farthest from the pixel by the files' formula %.4f px\n", coloured,
              cloud.size(), farthest);
  EXPECT_LT(farthest, 0.02);  // the files give the rotation to six digits

  EXPECT_LE(strangest, 1.0);

  // The same is done with the laser turned by half a degree about each axis of the lens. That moves points by 18 px,
  // and about the optical axis by 8 px at the border.
  Grey grey(*image);
  grey.blur(2);
  Grey changes = grey.across();
  changes.blur(4);
  const Alignment best = given.judge(grey, changes);
  std::printf("as given      edges %.3f silhouettes %.3f road %.3f\n", best.edges, best.silhouettes, best.road);
  for (int axis = 0; axis < 3; ++axis)
    for (const double degrees : {-0.5, 0.5}) {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      auto turned = read_json(mount_file);
      auto& rows = turned.begin()->at("param").at("sensor_calib").at("data");
      const Mount other{turn * mount.R, turn * mount.t};
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) rows[r][c] = other.R(static_cast<int>(r), static_cast<int>(c));
        rows[r][3] = other.t(static_cast<int>(r));
      }
      write_file(dir / "turned.json", turned.dump());
      const Alignment worse = shoot("turned", dir / "turned.json").judge(grey, changes);
      const double share =
          (worse.edges / best.edges + worse.silhouettes / best.silhouettes + worse.road / best.road) / 3;
      std::printf("%c by %+.1f deg  edges %.3f silhouettes %.3f road %.3f: %.3f of the given\n", "xyz"[axis], degrees,
                  worse.edges, worse.silhouettes, worse.road, share);
      EXPECT_LT(share, axis == 2 ? 0.97 : 0.9);
      EXPECT_LT(worse.edges, best.edges);
      EXPECT_LT(worse.road, best.road);
    }
}

}  // namespace
}  // namespace hueline::apps
