#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "storage/image_view.hpp"
#include "storage/las_reader.hpp"
#include "storage/png.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/test_data.hpp"

/// Tests the files that `hueline colour` reads and writes, with a cloud of five points before a lens that looks along
/// the scanner's x axis.
namespace hueline::apps {
namespace {
using namespace hueline::test;

struct LaserPoint {
  float x, y, z, intensity;
  std::uint16_t ring;
  double timestamp;
};
constexpr std::array<LaserPoint, 5> kPoints = {{{10.0F, 1.25F, -0.5F, 17.0F, 3, 1678066887.7009459},
                                                {127.0123F, -3.456789F, 0.7654321F, 255.0F, 127, 1678066887.7009462},
                                                {5.0F, -3.123456F, 0.000017F, 0.5F, 64, 1678066887.75},
                                                {-20.0F, 4.0F, 1.0F, 90.0F, 12, 1678066887.8},
                                                {30.0F, -40.0F, 2.0F, 33.25F, 0, 1678066887.9}}};

constexpr int kWidth = 160, kHeight = 120;
/// Returns the lens of an image that is `scale` times as large.
std::string lens_yaml(int width, int height, double scale = 1) {
  const auto at = [&](double centre) { return std::to_string((centre + 0.5) * scale - 0.5); };
  const std::string focal = std::to_string(100 * scale);
  return "lens:\n  model: brown\n  width: " + std::to_string(width) + "\n  height: " + std::to_string(height) +
         "\n  focal_px: [" + focal + ", " + focal + "]\n  principal_point_px: [" + at(79.5) + ", " + at(59.5) +
         "]\n  distortion: [0, 0, 0, 0, 0]\n";
}
/// Lens: x right, y down, z forward. Scanner: x forward, y left, z up.
constexpr const char* kMounting =
    "T_lens_scanner:\n  position_m: [0, 0, 0]\n  rotation_matrix: [0, -1, 0, 0, 0, -1, 1, 0, 0]\n";

storage::RgbImage picture(int scale = 1) {
  storage::RgbImage image(kWidth * scale, kHeight * scale, {});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.at(x, y) = {static_cast<std::uint8_t>(x / scale), static_cast<std::uint8_t>(2 * (y / scale)), 77};
  return image;
}

class Shot : public testing::Test {
 protected:
  void SetUp() override {
    std::string pcd =
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity ring timestamp\nSIZE 4 4 4 4 2 8\nTYPE F F F F U F\nCOUNT 1 "
        "1 1 1 1 1\nWIDTH 5\nHEIGHT 1\nPOINTS 5\nDATA binary\n";
    for (const LaserPoint& p : kPoints)
      for (const auto& [at, size] : {std::pair<const void*, std::size_t>{&p.x, 4},
                                     {&p.y, 4},
                                     {&p.z, 4},
                                     {&p.intensity, 4},
                                     {&p.ring, 2},
                                     {&p.timestamp, 8}})
        pcd.append(static_cast<const char*>(at), size);
    write_file(dir / "cloud.pcd", pcd);
    write_file(dir / "lens.yaml", lens_yaml(kWidth, kHeight));
    write_file(dir / "mounting.yaml", kMounting);
    ASSERT_TRUE(storage::write_png(dir / "image.png", picture()).ok());
  }
  Ran colour(const std::string& image, std::vector<std::string> calibration = {"lens.yaml", "mounting.yaml"},
             const std::string& size = "refuse") {
    std::vector<std::string> words = {"colour", dir / image, dir / cloud_file};
    for (const std::string& file : calibration) words.push_back(dir / file);
    for (const std::string& word : {std::string("--out"), std::string(dir / "out"), std::string("--image-size"), size})
      words.push_back(word);
    return run(words);
  }
  /// Returns all points of cloud.las. Their records stay valid as long as the test.
  std::vector<storage::LasPoint> cloud() {
    reader = std::make_unique<storage::LasReader>(storage::LasReader::open(dir / "out" / "cloud.las").value());
    std::vector<storage::LasPoint> points;
    EXPECT_TRUE(reader->next(points).ok());
    return points;
  }
  double extra(const storage::LasPoint& point, const std::string& name) {
    const auto* field = reader->extra_field(name);
    return field ? storage::LasReader::extra(point, *field) : std::nan("");
  }

  TemporaryFolder dir;
  std::string cloud_file = "cloud.pcd";
  std::unique_ptr<storage::LasReader> reader;
};

TEST_F(Shot, ColourKeepsWhatTheCloudHas) {
  const Ran ran = colour("image.png");
  ASSERT_EQ(ran.status, 0) << ran.said;
  const auto points = cloud();
  ASSERT_EQ(points.size(), kPoints.size());
  for (std::size_t i = 0; i < kPoints.size(); ++i) {
    EXPECT_NEAR(points[i].x, kPoints[i].x, 0.51e-6);
    EXPECT_NEAR(points[i].y, kPoints[i].y, 0.51e-6);
    EXPECT_NEAR(points[i].z, kPoints[i].z, 0.51e-6) << "no geodesy between the cloud and its copy";
    EXPECT_EQ(points[i].intensity, static_cast<int>(std::nearbyint(kPoints[i].intensity * 257.0)));
    EXPECT_EQ(extra(points[i], "cloud_intensity"), kPoints[i].intensity);
    EXPECT_EQ(extra(points[i], "ring"), kPoints[i].ring);
    EXPECT_EQ(extra(points[i], "timestamp"), kPoints[i].timestamp);
    EXPECT_EQ(points[i].time, kPoints[i].timestamp);
  }
  EXPECT_TRUE(reader->wkt().empty()) << "a shot has no place on Earth";
  // The first point: u = 79.5 - 100 * 1.25 / 10, v = 59.5 + 100 * 0.5 / 10.
  EXPECT_NEAR(extra(points[0], "image_u"), 67.0, 1e-4);
  EXPECT_NEAR(extra(points[0], "image_v"), 64.5, 1e-4);
  EXPECT_NEAR(points[0].red / 257.0, 67, 1);
  EXPECT_NEAR(points[0].green / 257.0, 129, 1);
  EXPECT_EQ(points[3].red + points[3].green + points[3].blue, 0) << "behind the lens";
  EXPECT_EQ(extra(points[3], "colour_state"), 3);
}

TEST_F(Shot, ColourRefusesAnImageOfAnotherSize) {
  write_file(dir / "lower.yaml", lens_yaml(kWidth, kHeight - 12));
  const Ran refused = colour("image.png", {"lower.yaml", "mounting.yaml"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.said.find("160 x 120 px"), std::string::npos) << refused.said;
  EXPECT_NE(refused.said.find("160 x 108"), std::string::npos) << refused.said;
  EXPECT_NE(refused.said.find("--image-size same-pixels"), std::string::npos) << refused.said;
  EXPECT_FALSE(std::filesystem::exists(dir / "out" / "cloud.las"));
  ASSERT_EQ(colour("image.png", {"lower.yaml", "mounting.yaml"}, "same-pixels").status, 0);
  EXPECT_NEAR(extra(cloud()[0], "image_v"), 64.5, 1e-4);

  // The image is twice as large, and the point has the same place in the picture.
  ASSERT_TRUE(storage::write_png(dir / "large.png", picture(2)).ok());
  EXPECT_EQ(colour("large.png").status, 2);
  ASSERT_EQ(colour("large.png", {"lens.yaml", "mounting.yaml"}, "scaled").status, 0);
  const auto points = cloud();
  EXPECT_NEAR(extra(points[0], "image_u"), 2 * 67.5 - 0.5, 1e-4);
  EXPECT_NEAR(extra(points[0], "image_v"), 2 * 65.0 - 0.5, 1e-4);

  const Ran aligned = run({"calibrate", "mount", "--image", dir / "image.png", "--cloud", dir / "cloud.pcd", "--lens",
                           dir / "lower.yaml", "--start", dir / "mounting.yaml"});
  EXPECT_EQ(aligned.status, 2);
  EXPECT_NE(aligned.said.find("--image-size same-pixels"), std::string::npos) << aligned.said;
}

TEST_F(Shot, ColourReadsPngAndJpegByTheirContent) {
  const auto jpeg = storage::encode_jpeg(picture(), 100);
  ASSERT_TRUE(jpeg.ok());
  const std::string bytes(reinterpret_cast<const char*>(jpeg->data()), jpeg->size());
  write_file(dir / "image.jpg", bytes);
  write_file(dir / "named.png", bytes);
  for (const char* file : {"image.jpg", "named.png"}) {
    const Ran ran = colour(file);
    ASSERT_EQ(ran.status, 0) << ran.said;
    EXPECT_NEAR(cloud()[0].red / 257.0, 67, 4);
  }
  write_file(dir / "cut.jpg", bytes.substr(0, bytes.size() / 2));
  EXPECT_EQ(colour("cut.jpg").status, 3);
  write_file(dir / "empty.jpg", "\xFF\xD8\xFF\xD9");
  const Ran empty = colour("empty.jpg");
  EXPECT_EQ(empty.status, 3) << empty.said;
  EXPECT_NE(empty.said.find("a JPEG without pixels"), std::string::npos) << empty.said;
  write_file(dir / "none.jpg", "GIF89a nothing");
  const Ran none = colour("none.jpg");
  EXPECT_EQ(none.status, 3);
  EXPECT_NE(none.said.find("neither a PNG nor a JPEG"), std::string::npos) << none.said;
}

/// A camera that was held upright says so in EXIF data. Its lens may be that of the image as stored, as `calibrate
/// lens` reads it, or as shown, as OpenCV reads it.
TEST_F(Shot, APhotographThatExifTurns) {
  const auto jpeg = storage::encode_jpeg(picture(), 100);
  ASSERT_TRUE(jpeg.ok());
  const auto write_turned = [&](const std::string& name, char orientation) {
    std::string bytes(reinterpret_cast<const char*>(jpeg->data()), jpeg->size());
    std::string exif(
        "\xFF\xE1\x00\x22"
        "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x01\0\0\0\0\0\0",
        36);
    exif[29] = orientation;
    write_file(dir / name, bytes.insert(2, exif));
  };
  write_turned("upright.jpg", 6);
  write_turned("head_down.jpg", 3);
  // The shown image has the upper border of the stored one on its right.
  write_file(dir / "shown.yaml",
             "lens: {model: brown, width: 120, height: 160, focal_px: [100, 100], principal_point_px: [59.5, 79.5], "
             "distortion: [0, 0, 0, 0, 0]}\n"
             "T_lens_scanner: {position_m: [0, 0, 0], rotation_matrix: [0, 0, 1, 0, -1, 0, 1, 0, 0]}\n");
  const Ran stored = colour("upright.jpg");
  ASSERT_EQ(stored.status, 0) << stored.said;
  EXPECT_NE(stored.said.find("turned by 90 deg to the right by its EXIF data; it is used as stored"), std::string::npos)
      << stored.said;
  EXPECT_NEAR(cloud()[0].red / 257.0, 67, 4);
  EXPECT_NEAR(extra(cloud()[0], "image_v"), 64.5, 1e-4);
  const Ran shown = colour("upright.jpg", {"shown.yaml"});
  ASSERT_EQ(shown.status, 0) << shown.said;
  EXPECT_NE(shown.said.find("it is used as shown"), std::string::npos) << shown.said;
  EXPECT_NEAR(cloud()[0].red / 257.0, 67, 4) << "the same point has the same colour";
  EXPECT_NEAR(cloud()[0].green / 257.0, 129, 4);
  EXPECT_NEAR(extra(cloud()[0], "image_u"), 54.5, 1e-4);
  EXPECT_NEAR(extra(cloud()[0], "image_v"), 67.0, 1e-4);

  // Upside down it has the same size.
  const Ran refused = colour("head_down.jpg");
  EXPECT_EQ(refused.status, 2) << refused.said;
  EXPECT_NE(refused.said.find("--image-turn stored"), std::string::npos) << refused.said;
  std::vector<std::string> words = {"colour",          dir / "head_down.jpg", dir / "cloud.pcd",
                                    dir / "lens.yaml", dir / "mounting.yaml", "--out",
                                    dir / "out",       "--image-turn",        "stored"};
  ASSERT_EQ(run(words).status, 0);
  EXPECT_NEAR(cloud()[0].red / 257.0, 67, 4);
  words.back() = "shown";
  ASSERT_EQ(run(words).status, 0);
  EXPECT_NEAR(cloud()[0].red / 257.0, 159 - 67, 4);

  // The alignment takes the image in the same ways. It then finds that five points align nothing.
  const auto aligned = [&](const char* image, const char* lens) {
    return run({"calibrate", "mount", "--image", dir / image, "--cloud", dir / "cloud.pcd", "--lens", dir / lens,
                "--start", dir / "mounting.yaml"})
        .said;
  };
  EXPECT_NE(aligned("upright.jpg", "lens.yaml").find("it is used as stored"), std::string::npos);
  EXPECT_NE(aligned("upright.jpg", "shown.yaml").find("it is used as shown"), std::string::npos);
  EXPECT_NE(aligned("head_down.jpg", "lens.yaml").find("--image-turn stored"), std::string::npos);
}

/// Parts of this real shot, searched alone, prefer other poses than the whole.
TEST_F(Shot, APairThatDoesNotFixItsPoseGivesNone) {
  HUELINE_REQUIRE_DATA("lidar_camera/second/0.pcd");
  const auto folder = data_file.parent_path();
  const Ran ran = run({"calibrate", "mount", "--image", folder / "0.jpg", "--cloud", data_file, "--lens",
                       folder / "calib.txt", "--start", folder / "calib.txt", "--out", dir / "out"});
  EXPECT_EQ(ran.status, 5) << ran.said;
  EXPECT_NE(ran.said.find("not determined: "), std::string::npos) << ran.said;
  EXPECT_FALSE(std::filesystem::exists(dir / "out" / "T_lens_scanner.yaml"));
}

TEST_F(Shot, ColourReadsWhatOthersPublish) {
  write_file(dir / "calib.txt", "K: 100 0 79.5 0 100 59.5 0 0 1\nD: 0 0 0 0\nT: 0 -1 0 0.25 0 0 -1 0 1 0 0 0\n");
  ASSERT_EQ(colour("image.png", {"calib.txt"}).status, 0);
  EXPECT_NEAR(extra(cloud()[0], "image_u"), 79.5 - 100 * 1.0 / 10, 1e-4);
  // KITTI: P2 = K [I | t], here with the same 0.25 m.
  write_file(dir / "kitti.txt",
             "P2: 100 0 79.5 25 0 100 59.5 0 0 0 1 0\nR0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 "
             "0 0 0\nTr_imu_to_velo: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  ASSERT_EQ(colour("image.png", {"kitti.txt"}).status, 0);
  EXPECT_NEAR(extra(cloud()[0], "image_u"), 79.5 - 100 * 1.0 / 10, 1e-4);
  write_file(dir / "mirror.txt", "K: 100 0 79.5 0 100 59.5 0 0 1\nT: 0 1 0 0 0 0 -1 0 1 0 0 0\n");
  const Ran mirrored = colour("image.png", {"mirror.txt"});
  EXPECT_EQ(mirrored.status, 3);
  EXPECT_NE(mirrored.said.find("mirror.txt: T is no rotation"), std::string::npos) << mirrored.said;
  write_file(dir / "odometry.txt", "P0: 100 0 79.5 0 0 100 59.5 0 0 0 1 0\n");
  EXPECT_EQ(colour("image.png", {"odometry.txt"}).status, 3);
}

/// Each form has the same lens, and the laser 0.25 m to its right.
TEST_F(Shot, CalibrationsInTheFormsOfOtherPrograms) {
  const std::map<std::string, std::string> files = {
      {"flat.json", R"({"camera": {"K": [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1], "D": [0, 0, 0, 0, 0]}})"},
      {"pose.json", R"({"T": [[0, -1, 0, 0.25], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]})"},
      {"calib.json", R"({"camera": {"camera_model": "plumb_bob", "distortion_coeffs": [0, 0, 0, 0, 0],
                         "intrinsics": [100, 100, 79.5, 59.5]},
                         "results": {"T_lidar_camera": [0, 0.25, 0, -0.5, 0.5, -0.5, 0.5]}})"},
      {"ros.yaml",
       "image_width: 160\nimage_height: 120\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [100, 0, "
       "79.5, 0, 100, 59.5, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  "
       "data: [0, 0, 0, 0, 0]\n"},
      {"autoware.yaml",
       "%YAML:1.0\n---\nCameraExtrinsicMat: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ 0., 0., 1., "
       "0., -1., 0.,\n       0., 0.25, 0., -1., 0., 0., 0., 0., 0., 1. ]\nCameraMat: !!opencv-matrix\n   rows: 3\n   "
       "cols: 3\n   dt: d\n   data: [ 100., 0., 79.5, 0., 100., 59.5, 0., 0., 1. ]\nDistCoeff: !!opencv-matrix\n   "
       "rows: "
       "1\n   cols: 5\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\nImageSize: [ 160, 120 ]\n"},
      {"livox.yaml",
       "camera:\n  camera_matrix: [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1]\n  dist_coeffs: [0, 0, 0, 0, 0]\n"},
      {"livox.txt", "0,-1,0,0.25\n0,0,-1,0\n1,0,0,0\n0,0,0,1\n"},
      {"titled.txt", "intrinsic\n100 0 79.5\n0 100 59.5\n0 0 1\n\ndistortion\n0 0 0 0 0\n"},
      {"kalibr.yaml",
       "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n  intrinsics: "
       "[100, "
       "100, 79.5, 59.5]\n  resolution: [160, 120]\n  rostopic: /left\n"},
      {"cam_to_cam.txt",
       "calib_time: 09-Jan-2012 13:57:47\nS_rect_02: 160 120\nR_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_02: 100 0 79.5 25 0 "
       "100 59.5 0 0 0 1 0\n"},
      {"tracking.txt",
       "P2: 100 0 79.5 25 0 100 59.5 0 0 0 1 0\nR_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 0 -1 0 0 0 0 -1 0 1 0 0 0\n"},
      {"only_pose.txt", "# from the laser to the lens\nT:\n0 -1 0 0.25\n0 0 -1 0\n1 0 0 0\n0 0 0 1\n"},
      {"rows.txt", "K:\n100 0 79.5\n0 100 59.5\n0 0 1\nD: 0 0 0 0  # k1 k2 p1 p2\n"},
      {"named.json",
       R"({"K": [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1], "D": [], "model": "Hikvision MV-CA", "camera_model":
                         "PINHOLE"})"},
      {"lists.txt", "K: [100, 0, 79.5; 0, 100, 59.5; 0, 0, 1]\nD: [0, 0, 0, 0]\n"},
      {"perspective.txt",
       "calib_time: 2020\nS_rect_00: 160 120\nR_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_00: 100 0 79.5 0 0 100 59.5 0 0 0 "
       "1 0\nP_rect_01: 100 0 79.5 -60 0 100 59.5 0 0 0 1 0\n"},
      {"camera_to_lidar.txt", "0 0 1 0\n-1 0 0 0.25\n0 -1 0 0\n"},
      {"P_camera.txt", "100 0 79.5 0\n0 100 59.5 0\n0 0 1 0\n0 0 0 1\n"},
      {"camera_info.txt", "100 100 79.5 59.5\n"},
      {"camera_info.yaml",
       "header:\n  seq: 1\n  frame_id: left\nheight: 120\nwidth: 160\ndistortion_model: \"plumb_bob\"\nD: [0, 0, 0, "
       "0, 0]\nK: [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1]\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n---\nheader:\n  seq: 2\n"},
      {"camera_info_2.yaml",
       "height: 120\nwidth: 160\ndistortion_model: plumb_bob\nd:\n- 0.0\n- 0.0\n- 0.0\n- 0.0\n- 0.0\nk:\n- 100.0\n- "
       "0.0\n- 79.5\n- 0.0\n- 100.0\n- 59.5\n- 0.0\n- 0.0\n- 1.0\n"},
      {"front_6mm.yaml",
       "header:\n  stamp: {secs: 0, nsecs: 0}\n  frame_id: velodyne128\nchild_frame_id: front_6mm\ntransform:\n  "
       "translation: {x: 0, y: 0.25, z: 0}\n  rotation: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}\n"},
      {"static.yaml",
       "header: {frame_id: camera_optical}\nchild_frame_id: rslidar\ntransform:\n  translation: {x: 0.25, y: 0, z: "
       "0}\n  rotation: {x: 0.5, y: -0.5, z: 0.5, w: 0.5}\n"},
      {"transforms.yaml",
       "os1_cloud_node-pylon_camera_node:\n  q: {w: -0.5, x: 0.5, y: -0.5, z: 0.5}\n  t: {x: 0, y: 0.25, z: 0}\n"},
      {"camera_pinhole.yaml",
       "cam_model: Pinhole\ncam_width: 160\ncam_height: 120\nscale: 0.5\ncam_fx: 100\ncam_fy: 100\ncam_cx: "
       "79.5\ncam_cy: 59.5\ncam_d0: 0\ncam_d1: 0\n"},
      {"avia.yaml",
       "/fastlivo2_node:\n  ros__parameters:\n    extrin_calib:\n      extrinsic_T: [1, 2, 3]\n      Rcl: [0, -1, "
       "0,\n            0, 0, -1,\n            1, 0, 0]\n      Pcl: [0.25, 0, 0]\n    camera:\n      model: Pinhole\n  "
       "    width: 160\n      height: 120\n      fx: 100\n      fy: 100\n      cx: 79.5\n      cy: 59.5\n"},
      {"front.json",
       R"({"extrinsic": [0, -1, 0, 0.25, 0, 0, -1, 0, 1, 0, 0, 0, 0, 0, 0, 1], "intrinsic": [100, 0, 79.5, 0, 100, 59.5,
           0, 0, 1]})"},
      {"hitsz.json",
       R"({"cam": {"K": [[100, 0, 79.5], [0, 100, 59.5], [0, 0, 1]], "D": [0, 0, 0, 0, 0]},
           "tf": [[0, -1, 0, 0.25], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]})"},
      {"camera_intrinsic.json", R"({"cam_D": [0, 0, 0, 0, 0], "cam_K": [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1]})"},
      {"virtuallidar_to_camera.json",
       R"({"translation": [[0.25], [0], [0]], "rotation": [[0, -1, 0], [0, 0, -1], [1, 0, 0]]})"},
      {"velo_to_cam.txt", "calib_time: 15-Mar-2012 11:37:16\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 0\ndelta_f: 0 0\n"},
  };
  for (const auto& [name, text] : files) write_file(dir / name, text);
  for (const auto& calibration :
       std::vector<std::vector<std::string>>{{"flat.json", "pose.json"},
                                             {"calib.json"},
                                             {"ros.yaml", "pose.json"},
                                             {"autoware.yaml"},
                                             {"livox.yaml", "livox.txt"},
                                             {"titled.txt", "livox.txt"},
                                             {"tracking.txt"},
                                             {"lists.txt", "livox.txt"},
                                             {"rows.txt", "only_pose.txt"},
                                             {"named.json", "only_pose.txt"},
                                             {"kalibr.yaml", "livox.txt"},
                                             {"cam_to_cam.txt", "velo_to_cam.txt"},
                                             {"velo_to_cam.txt", "cam_to_cam.txt"},
                                             {"cam_to_cam.txt", "pose.json"},
                                             {"perspective.txt", "camera_to_lidar.txt"},
                                             {"P_camera.txt", "livox.txt"},
                                             {"camera_info.txt", "transforms.yaml"},
                                             {"camera_info.yaml", "front_6mm.yaml"},
                                             {"camera_info_2.yaml", "static.yaml"},
                                             {"camera_pinhole.yaml", "livox.txt"},
                                             {"avia.yaml"},
                                             {"front.json"},
                                             {"hitsz.json"},
                                             {"camera_intrinsic.json", "virtuallidar_to_camera.json"}}) {
    SCOPED_TRACE(calibration.front());
    const Ran ran = colour("image.png", calibration);
    ASSERT_EQ(ran.status, 0) << ran.said;
    EXPECT_NEAR(extra(cloud()[0], "image_u"), 79.5 - 100 * 1.0 / 10, 1e-4);
    EXPECT_NEAR(extra(cloud()[0], "image_v"), 59.5 + 100 * 0.5 / 10, 1e-4);
  }
  // The size that stands beside a lens counts.
  ASSERT_TRUE(storage::write_png(dir / "large.png", picture(2)).ok());
  for (const char* name : {"ros.yaml", "autoware.yaml", "kalibr.yaml", "cam_to_cam.txt", "perspective.txt",
                           "camera_info.yaml", "camera_info_2.yaml", "camera_pinhole.yaml", "avia.yaml"}) {
    const Ran ran = colour("large.png", {name, "pose.json"});
    EXPECT_EQ(ran.status, 2) << name;
    EXPECT_NE(ran.said.find("160 x 120"), std::string::npos) << ran.said;
  }
}

/// The point of this cloud is seen at 7.2 deg; a distortion of 0.5 makes the two models differ by half a pixel.
TEST_F(Shot, TheModelOfALensIsTakenByTheNameThatItsProgramGives) {
  const std::string matrix = "camera_matrix: [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1]\n",
                    D = "distortion_coefficients: [0.5, 0, 0, 0]\n";
  write_file(dir / "brown.yml", matrix + D);
  ASSERT_EQ(colour("image.png", {"brown.yml", "mounting.yaml"}).status, 0);
  const double brown = extra(cloud()[0], "image_u");
  const double angle = std::atan(std::hypot(0.125, 0.05)), radius = angle * (1 + 0.5 * angle * angle);
  const double fisheye = 79.5 - 100 * radius * 0.125 / std::hypot(0.125, 0.05);
  ASSERT_GT(std::abs(brown - fisheye), 0.05);
  for (
      const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
          {"opencv.yml", matrix + D + "fisheye_model: 1\n"},
          {"ros.yml", matrix + D + "distortion_model: equidistant\n"},
          {"autoware.yml",
           "CameraMat: {data: [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1]}\nDistCoeff: {data: [0.5, 0, 0, 0]}\nDistModel: "
           "fisheye\n"},
          {"lens.json",
           R"({"K": [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1], "D": [0.5, 0, 0, 0], "distortion_model": "equidistant"})"}}) {
    write_file(dir / name, text);
    const Ran ran = colour("image.png", {name, "mounting.yaml"});
    ASSERT_EQ(ran.status, 0) << ran.said;
    EXPECT_NEAR(extra(cloud()[0], "image_u"), fisheye, 1e-3) << name;
  }
  write_file(dir / "brown.json", R"({"K": [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1], "width": 320, "height": 240})");
  EXPECT_NE(colour("image.png", {"brown.json", "mounting.yaml"}).said.find("320 x 240"), std::string::npos);
}

TEST_F(Shot, ALensThatIsNotReadIsRefused) {
  const std::string matrix = "camera_matrix: [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1]\n";
  for (const auto& [text, said] : std::vector<std::pair<std::string, std::string>>{
           {matrix + "distortion_model: double_sphere\n", "the lens model double_sphere is not read"},
           {matrix + "distortion_coefficients: {data: [0, 0, 0, 0, 0, 0.5, 0, 0]}\n",
            "the size of the image is missing"},
           {matrix + "distortion_coefficients: {data: [0, 0, 0, 0, 0, 0, 0, 0, 0.1]}\n", "has 9 numbers of distortion"},
           {matrix + "distortion_coeffs: {k1: 0.1, k2: 0}\n", "distortion_coeffs is no list of numbers"},
           {matrix + "model: DOUBLE_SPHERE\n", "the lens model DOUBLE_SPHERE is not read"},
           {"model_type: PINHOLE\nfx: 100\n", "holds no calibration that is read"},
           {matrix + "xi: 1.2\n", "a lens of the model omni is not read without"},
           {"cam0: {camera_model: ds, distortion_model: radtan, intrinsics: [0, 0.6, 9, 9, 9, 9]}\n",
            "cam0 is read if"},
           {"model_type: SCARAMUZZA\nprojection_parameters: {a: 1}\n", "model_type SCARAMUZZA is not read"},
           {"camera_matrix: [100, 0, 79.5]\n", "camera_matrix has 3 numbers"},
           {"camera_matrix: [a, 0, 79.5, 0, 100, 59.5, 0, 0, 1]\n", "lens.yaml:1: 'a' is no number"},
           {"CameraExtrinsicMat: {data: [1, 2]}\n", "CameraExtrinsicMat has 2 numbers; allowed: 12 or 16"},
           {"cam_model: Ocam\ncam_fx: 9\ncam_fy: 9\ncam_cx: 9\ncam_cy: 9\n", "cam_model Ocam is not read"},
           {"Rcl: [1, 0, 0]\nPcl: [0, 0, 0]\n", "Rcl has 3 numbers and Pcl 3; allowed: 9 and 3"},
           {"header: {frame_id: novatel}\nchild_frame_id: velodyne128\ntransform: {translation: {x: 0, y: 0, z: 0}, "
            "rotation: {x: 0, y: 0, z: 0, w: 2}}\n",
            "a quaternion of length 2, not 1"},
           {"left-right: {q: {w: 1, x: 0, y: 0, z: 0}, t: {x: 0, y: 0, z: 0}}\n",
            "these names do not say that one is a laser and the other a camera"},
           {"header: {frame_id: novatel}\nchild_frame_id: CAM_FRONT_LEFT\ntransform: {translation: {x: 0, y: 0, z: 0}, "
            "rotation: {x: 0, y: 0, z: 0, w: 1}}\n",
            "holds the pose of CAM_FRONT_LEFT in the frame of novatel"},
           {"header: {frame_id: novatel}\nchild_frame_id: velodyne64\ntransform: {translation: {x: 0, y: 0, z: 0}, "
            "rotation: {x: 0, y: 0, z: 0, w: 1}}\n",
            "holds the pose of velodyne64 in the frame of novatel"},
           {"camera-lidar: {q: {w: 1, x: 0, y: 0}, t: {x: 0, y: 0, z: 0}}\n", "the rotation has no z"}}) {
    write_file(dir / "lens.yaml", text);
    const Ran ran = colour("image.png", {"lens.yaml", "mounting.yaml"});
    EXPECT_EQ(ran.status, 3) << text;
    EXPECT_NE(ran.said.find(said), std::string::npos) << ran.said;
  }
  write_file(dir / "columns.txt", "0 0 1 0\n-1 0 0 0\n0 -1 0 0\n0.25 0 0 1\n");
  EXPECT_NE(colour("image.png", {"columns.txt"}).said.find("its last row is not 0 0 0 1"), std::string::npos);
  write_file(dir / "bad.txt", "K: 100 0 79.5 0 100 59.5 0 0 1\nD: 0.1 k2\n");
  EXPECT_NE(colour("image.png", {"bad.txt"}).said.find("bad.txt: D: 'k2' is no number"), std::string::npos);
  write_file(dir / "words.txt", "the camera was new\n");
  EXPECT_NE(colour("image.png", {"words.txt"}).said.find("words.txt:1: is neither"), std::string::npos);
  for (const char* text : {R"({"K": "none"})", R"({"K": [[[[[1]]]]]})", R"({"K": {"data": 1}})"}) {
    write_file(dir / "matrix.json", text);
    EXPECT_NE(colour("image.png", {"matrix.json"}).said.find("matrix.json: K has 0 numbers"), std::string::npos)
        << text;
  }
  write_file(dir / "words.json", R"({"K": [100, 0, 79.5, 0, 100, 59.5, 0, 0, 1], "D": ["0.1", "0"]})");
  EXPECT_NE(colour("image.png", {"words.json"}).said.find("D is no list of numbers"), std::string::npos);
  write_file(
      dir / "gnss.json",
      R"({"x": {"sensor_name": "gnss", "target_sensor_name": "top_center_lidar", "param": {"sensor_calib": {"data":
                 [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}}})");
  EXPECT_NE(colour("image.png", {"gnss.json"}).said.find("the pose of gnss in the frame of top_center_lidar"),
            std::string::npos);
  write_file(dir / "lidar_to_novatel.json",
             R"({"transform": {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": {"x": 1}}})");
  EXPECT_NE(colour("image.png", {"lidar_to_novatel.json"}).said.find("translation 0; allowed: 9 and 3"),
            std::string::npos);
  write_file(dir / "lidar_to_novatel.json",
             R"({"transform": {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [1, 2, 3]}})");
  EXPECT_NE(colour("image.png", {"lidar_to_novatel.json"}).said.find("lead from the laser to the camera"),
            std::string::npos);
  write_file(dir / "list.json", "[1, 2]");
  EXPECT_NE(colour("image.png", {"list.json"}).said.find("list.json: holds neither K and T"), std::string::npos);
}

/// The clouds of KITTI and nuScenes, and those of programs that write PLY.
TEST_F(Shot, CloudsInTheFormatsOfOthers) {
  const auto rows = [&](bool has_rings) {
    std::string out;
    for (const LaserPoint& p : kPoints) {
      for (const float value : {p.x, p.y, p.z, p.intensity}) out.append(reinterpret_cast<const char*>(&value), 4);
      const float ring = p.ring;
      if (has_rings) out.append(reinterpret_cast<const char*>(&ring), 4);
    }
    return out;
  };
  const std::string head =
      "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\nproperty "
      "float "
      "ring\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string little = rows(true);
  std::string big = little;
  for (std::size_t at = 0; at < big.size(); at += 4)
    std::reverse(big.begin() + static_cast<long>(at), big.begin() + static_cast<long>(at) + 4);
  std::string text;
  for (const LaserPoint& p : kPoints) {
    char line[128];
    std::snprintf(line, sizeof line, "%.9g %.9g %.9g %.9g %d\n", p.x, p.y, p.z, p.intensity, p.ring);
    text += line;
  }
  const std::map<std::string, std::string> clouds = {
      {"kitti.bin", rows(false)},
      {"nuscenes.pcd.bin", little},
      {"little.ply", "ply\nformat binary_little_endian 1.0\n" + head + little},
      {"big.ply", "ply\nformat binary_big_endian 1.0\n" + head + big},
      {"text.ply", "ply \r\nformat ascii 1.0\n" + head + text}};
  for (const auto& [name, bytes] : clouds) {
    SCOPED_TRACE(name);
    write_file(dir / name, bytes);
    cloud_file = name;
    const Ran ran = colour("image.png");
    ASSERT_EQ(ran.status, 0) << ran.said;
    const auto points = cloud();
    ASSERT_EQ(points.size(), kPoints.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(points[i].x, kPoints[i].x, 1e-6);
      EXPECT_NEAR(points[i].z, kPoints[i].z, 1e-6);
      EXPECT_EQ(extra(points[i], "cloud_intensity"), kPoints[i].intensity);
      if (name != "kitti.bin") {
        EXPECT_EQ(extra(points[i], "ring"), kPoints[i].ring);
      }
    }
  }
  const std::map<std::string, std::string> formats = {
      {"kitti.bin", "rows of float32"}, {"nuscenes.pcd.bin", "rows of float32"}, {"text.ply", "PLY"}};
  for (const auto& [name, format] : formats) {
    const Ran ran = run({"inspect", dir / name});
    EXPECT_EQ(ran.status, 0) << ran.said;
    EXPECT_NE(ran.said.find(format), std::string::npos) << ran.said;
    EXPECT_NE(ran.said.find("points                   5"), std::string::npos) << ran.said;
  }
  // Its own output is LAS.
  std::filesystem::copy_file(dir / "out" / "cloud.las", dir / "again.las");
  cloud_file = "again.las";
  ASSERT_EQ(colour("image.png").status, 0);
  EXPECT_NEAR(cloud()[1].x, kPoints[1].x, 1e-6);

  for (const auto& [name, bytes, said] : std::vector<std::array<std::string, 3>>{
           {"cut.bin", rows(false).substr(0, 78), "its 78 bytes are no rows of 3 to 6 float32"},
           {"empty.bin", "", "its 0 bytes are no rows"},
           {"cut.ply", clouds.at("little.ply").substr(0, 300), "holds"},
           {"faces.ply",
            "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int v\nelement vertex 1\nproperty float "
            "x\nend_header\n",
            "are not its first element"},
           {"head.ply", "ply\nformat ascii 1.0\nelement vertex 1\n", "has no end_header"}}) {
    write_file(dir / name, bytes);
    cloud_file = name;
    const Ran ran = colour("image.png");
    EXPECT_EQ(ran.status, 3) << name;
    EXPECT_NE(ran.said.find(said), std::string::npos) << ran.said;
  }
}

/// Lenses of models that hueline does not compute with. The pixels here are those of the models' own formulas.
TEST_F(Shot, LensesOfOtherModels) {
  using Plane = std::function<Eigen::Vector2d(double x, double y, double z)>;
  const auto radtan = [](Eigen::Vector2d m, double k1, double k2, double p1, double p2) -> Eigen::Vector2d {
    const double q = m.squaredNorm(), radial = 1 + q * (k1 + q * k2);
    return {m.x() * radial + 2 * p1 * m.x() * m.y() + p2 * (q + 2 * m.x() * m.x()),
            m.y() * radial + p1 * (q + 2 * m.y() * m.y()) + 2 * p2 * m.x() * m.y()};
  };
  const auto norm = [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); };
  struct Model {
    std::string name, text;
    double focal, centre, widest_deg, most_px;
    Plane plane;
  };
  const std::vector<Model> models = {
      // The left fisheye of KITTI-360.
      {"omni",
       "%YAML:1.0\n---\nmodel_type: MEI\nimage_width: 1400\nimage_height: 1400\nmirror_parameters: {xi: 2.2134}\n"
       "distortion_parameters: {k1: 0.0168, k2: 1.6549, p1: 4.2e-4, p2: 4.2e-4}\n"
       "projection_parameters: {gamma1: 1336, gamma2: 1336, u0: 716.9, v0: 716.9}\n",
       1336, 716.9, 95, 0.7,
       [&](double x, double y, double z) {
         const double d = norm(x, y, z), below = z / d + 2.2134;
         return radtan({x / d / below, y / d / below}, 0.0168, 1.6549, 4.2e-4, 4.2e-4);
       }},
      {"ds",
       "cam0: {camera_model: ds, distortion_model: none, distortion_coeffs: [], intrinsics: [-0.2, 0.59, 380, 380, "
       "700, 700], resolution: [1400, 1400]}\ncam1: {}\n",
       380, 700, 90, 0.5,
       [&](double x, double y, double z) -> Eigen::Vector2d {
         const double z1 = z - 0.2 * norm(x, y, z), below = 0.59 * norm(x, y, z1) + 0.41 * z1;
         return {x / below, y / below};
       }},
      {"eucm",
       "cam0: {camera_model: eucm, distortion_model: none, distortion_coeffs: [], intrinsics: [0.6, 1.1, 400, 400, "
       "700, 700], resolution: [1400, 1400]}\n",
       400, 700, 85, 0.5,
       [](double x, double y, double z) -> Eigen::Vector2d {
         const double below = 0.6 * std::sqrt(1.1 * (x * x + y * y) + z * z) + 0.4 * z;
         return {x / below, y / below};
       }},
      {"fov",
       "cam0: {camera_model: pinhole, distortion_model: fov, distortion_coeffs: [0.93], intrinsics: [600, 600, 700, "
       "700], resolution: [1400, 1400]}\n",
       600, 700, 50, 0.5,
       [](double x, double y, double z) -> Eigen::Vector2d {
         const double m = std::hypot(x, y) / z, r = m > 0 ? std::atan(2 * m * std::tan(0.465)) / 0.93 / m : 1;
         return {r * x / z, r * y / z};
       }},
      // The colour camera of an Azure Kinect.
      {"rational",
       "image_width: 1400\nimage_height: 1400\ncamera_matrix: [900, 0, 700, 0, 900, 700, 0, 0, 1]\n"
       "distortion_model: rational_polynomial\ndistortion_coefficients: [0.58, -2.77, 6.0e-4, 1.0e-4, 1.58, 0.46, "
       "-2.58, 1.50]\n",
       900, 700, 35, 0.5, [](double x, double y, double z) -> Eigen::Vector2d {
         const double a = x / z, b = y / z, q = a * a + b * b;
         const double r = (1 + q * (0.58 + q * (-2.77 + q * 1.58))) / (1 + q * (0.46 + q * (-2.58 + q * 1.5)));
         return {a * r + 2 * 6e-4 * a * b + 1e-4 * (q + 2 * a * a), b * r + 6e-4 * (q + 2 * b * b) + 2e-4 * a * b};
       }}};
  ASSERT_TRUE(storage::write_png(dir / "large.png", storage::RgbImage(1400, 1400, {9, 9, 9})).ok());
  for (const Model& model : models) {
    SCOPED_TRACE(model.name);
    std::vector<Eigen::Vector3d> places;
    std::string bytes;
    for (int i = 0; i < 64; ++i) {
      const double angle = model.widest_deg * M_PI / 180 * (i + 1) / 64, turn = 2.4 * i;
      const Eigen::Vector3d p(10 * std::sin(angle) * std::cos(turn), 10 * std::sin(angle) * std::sin(turn),
                              10 * std::cos(angle));
      // The lens looks along the scanner's x axis.
      const std::array<float, 4> row = {static_cast<float>(p.z()), static_cast<float>(-p.x()),
                                        static_cast<float>(-p.y()), 1};
      bytes.append(reinterpret_cast<const char*>(row.data()), sizeof row);
      places.push_back(p);
    }
    write_file(dir / "fan.bin", bytes);
    write_file(dir / "other.yaml", model.text);
    cloud_file = "fan.bin";
    const Ran ran = colour("large.png", {"other.yaml", "mounting.yaml"});
    ASSERT_EQ(ran.status, 0) << ran.said;
    EXPECT_NE(ran.said.find("has the model " + model.name), std::string::npos) << ran.said;
    EXPECT_EQ(ran.said.find("the lens is that of cam0") != std::string::npos, model.name == "ds") << ran.said;
    const auto points = cloud();
    ASSERT_EQ(points.size(), places.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d pixel = model.focal * model.plane(places[i].x(), places[i].y(), places[i].z()) +
                                    Eigen::Vector2d::Constant(model.centre);
      const Eigen::Vector2d found(extra(points[i], "image_u"), extra(points[i], "image_v"));
      EXPECT_LT((found - pixel).norm(), model.most_px) << "point " << i << " at " << pixel.transpose();
    }
  }
}

/// Points measured in an image whose lens another program has calibrated.
TEST_F(Shot, MountTakesThePublishedLens) {
  write_file(
      dir / "ros.yaml",
      "image_width: 160\nimage_height: 120\ncamera_matrix: {rows: 3, cols: 3, data: [100, 0, 79.5, 0, 100, 59.5, "
      "0, 0, 1]}\ndistortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n");
  const auto mount = [&](double off_px) {
    std::string csv = "u_px,v_px,x_m,y_m,z_m\n";
    for (int i = 0; i < 12; ++i) {
      const double x = 4 + i % 5, y = 0.3 * (i % 7) - 1, z = 0.25 * (i % 4) - 0.5;
      csv +=
          fmt::format("{},{},{},{},{}\n", 79.5 - 100 * y / x + (i % 2 ? off_px : -off_px), 59.5 - 100 * z / x, x, y, z);
    }
    write_file(dir / "points.csv", csv);
    return run({"calibrate", "mount", "--points", dir / "points.csv", "--lens", dir / "ros.yaml", "--sigma-px", "0.1",
                "--sigma-point-m", "0", "--out", dir / "mount"});
  };
  const Ran ran = mount(0);
  ASSERT_EQ(ran.status, 0) << ran.said;
  EXPECT_EQ(ran.said.find("allow"), std::string::npos) << ran.said;
  ASSERT_EQ(colour("image.png", {"lens.yaml", "mount/lens.yaml"}).status, 0);
  EXPECT_NEAR(extra(cloud()[0], "image_u"), 67.0, 1e-3);
  EXPECT_NE(mount(0.5).said.find("times as much as --sigma-px and --sigma-point-m allow"), std::string::npos);
}

/// Rows of float32 say nothing of their length. Those of 3, 5 or 6 numbers whose size fits rows of 4 as well were read
/// as rows of 4: wrong places, and status 0.
TEST_F(Shot, RowsOfFloatsOfAnyLength) {
  constexpr int kRows = 240;  // a multiple of 3, 4, 5 and 6
  for (const std::size_t length : {3, 4, 5, 6})
    for (const bool in_order : {true, false}) {
      std::string bytes;
      for (int i = 0; i < kRows; ++i) {
        const double turn = 0.005 * (in_order ? i : i * 77 % kRows) - 0.6;
        const std::array<float, 6> row = {
            static_cast<float>(20 * std::cos(turn)), static_cast<float>(20 * std::sin(turn)), -1.7F,
            0.3F + 0.1F * static_cast<float>(i % 3), 0.0004F * static_cast<float>(i),         0.25F};
        bytes.append(reinterpret_cast<const char*>(row.data()), sizeof(float) * length);
      }
      write_file(dir / "rows.bin", bytes);
      cloud_file = "rows.bin";
      SCOPED_TRACE(testing::Message() << length << " numbers in a row");
      const Ran ran = colour("image.png");
      ASSERT_EQ(ran.status, 0) << ran.said;
      const auto points = cloud();
      ASSERT_EQ(points.size(), static_cast<std::size_t>(kRows));
      for (const auto& p : points) ASSERT_NEAR(std::hypot(p.x, p.y), 20, 1e-4);
      EXPECT_EQ(ran.said.find("has no field intensity") != std::string::npos, length == 3) << ran.said;
      if (length >= 5) {
        EXPECT_NEAR(extra(points[100], "column_5"), 0.04, 1e-6);
      }
    }
}

/// Arrays of NumPy, with a row for each point.
TEST_F(Shot, CloudsOfNumpy) {
  const auto write = [&](const std::string& descr, const std::string& shape, const std::string& data) {
    std::string header = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({}), }}", descr, shape);
    header.resize(118, ' ');
    write_file(dir / "cloud.npy", std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + data);
    cloud_file = "cloud.npy";
  };
  std::string floats, doubles;
  for (const LaserPoint& p : kPoints)
    for (const float value : {p.x, p.y, p.z, p.intensity, 0.5F}) {
      const double wide = value;
      floats.append(reinterpret_cast<const char*>(&value), sizeof value);
      doubles.append(reinterpret_cast<const char*>(&wide), sizeof wide);
    }
  for (const bool is_wide : {false, true}) {
    write(is_wide ? "'<f8'" : "'<f4'", "5, 5", is_wide ? doubles : floats);
    const Ran ran = colour("image.png");
    ASSERT_EQ(ran.status, 0) << ran.said;
    EXPECT_EQ(cloud().size(), 5u);
    EXPECT_NEAR(cloud()[1].x, kPoints[1].x, 1e-6);
    EXPECT_EQ(extra(cloud()[1], "cloud_intensity"), 255);
    EXPECT_EQ(extra(cloud()[1], "column_5"), 0.5);
    EXPECT_NE(run({"inspect", dir / cloud_file}).said.find("NumPy array"), std::string::npos);
  }
  for (const auto& [descr, shape, said] :
       std::vector<std::array<std::string, 3>>{{"'<i4'", "5, 5", "of this kind is not read: {'descr': '<i4'"},
                                               {"[('x', '<f4')]", "5,", "of this kind is not read"},
                                               {"'<f4'", "25,", "of this kind is not read"},
                                               {"'<f4'", "6, 5", "holds 100 bytes of points; its header needs 120"}}) {
    write(descr, shape, floats);
    const Ran ran = colour("image.png");
    EXPECT_EQ(ran.status, 3);
    EXPECT_NE(ran.said.find(said), std::string::npos) << ran.said;
  }
}

/// KITTI-360 gives the pose of the camera in the laser's frame; only the name of the file says so.
TEST_F(Shot, APoseFromCameraToLaser) {
  write_file(dir / "calib_cam_to_velo.txt", "0 0 1 0.5 -1 0 0 0.25 0 -1 0 0\n");
  write_file(dir / "calib_velo_to_cam.txt", "0 -1 0 0.25 0 0 -1 0 1 0 0 -0.5\n");
  ASSERT_EQ(colour("image.png", {"lens.yaml", "calib_velo_to_cam.txt"}).status, 0);
  const double u = extra(cloud()[0], "image_u"), v = extra(cloud()[0], "image_v");
  EXPECT_GT(u, 0);
  const Ran ran = colour("image.png", {"lens.yaml", "calib_cam_to_velo.txt"});
  ASSERT_EQ(ran.status, 0) << ran.said;
  EXPECT_NE(ran.said.find("was turned round"), std::string::npos) << ran.said;
  EXPECT_NEAR(extra(cloud()[0], "image_u"), u, 1e-4);
  EXPECT_NEAR(extra(cloud()[0], "image_v"), v, 1e-4);
}

/// A pose has its rotation in a few digits, which must not move a cloud that is far from its origin.
TEST_F(Shot, ACloudInCoordinatesOfAMap) {
  const Eigen::Vector3d origin(455123.25, 5428765.5, 212.75);
  // Turned by 0.3 rad, with five digits.
  const Eigen::Matrix3d R{{0.29552, -0.95534, 0}, {0, 0, -1}, {0.95534, 0.29552, 0}};
  const Eigen::Vector3d t = -R * origin;
  std::string pcd =
      "VERSION 0.7\nFIELDS x y z scalar_Intensity\nSIZE 8 8 8 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 5\nHEIGHT "
      "1\nPOINTS 5\nDATA ascii\n";
  for (const LaserPoint& p : kPoints) {
    const Eigen::Vector3d at =
        Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) * Eigen::Vector3d(p.x, p.y, p.z) + origin;
    pcd += fmt::format("{:.6f} {:.6f} {:.6f} {}\n", at.x(), at.y(), at.z(), p.intensity);
  }
  write_file(dir / "map.pcd", pcd);
  std::string text;
  for (int row = 0; row < 3; ++row) text += fmt::format("{} {} {} {:.9f}\n", R(row, 0), R(row, 1), R(row, 2), t[row]);
  write_file(dir / "pose.txt", text + "0 0 0 1\n");
  cloud_file = "map.pcd";
  const Ran ran = colour("image.png", {"lens.yaml", "pose.txt"});
  ASSERT_EQ(ran.status, 0) << ran.said;
  EXPECT_NEAR(extra(cloud()[0], "image_u"), 67.0, 0.01);
  EXPECT_NEAR(extra(cloud()[0], "image_v"), 64.5, 0.01);
  EXPECT_NE(ran.said.find("its intensity is the cloud's scalar_Intensity times 257"), std::string::npos) << ran.said;

  // The rings of a scanner are seen from its place.
  const Ran refused = run({"calibrate", "mount", "--image", dir / "image.png", "--cloud", dir / "map.pcd", "--lens",
                           dir / "lens.yaml", "--start", dir / "pose.txt"});
  EXPECT_EQ(refused.status, 3);
  EXPECT_NE(refused.said.find("as in coordinates of a map"), std::string::npos) << refused.said;
}

}  // namespace
}  // namespace hueline::apps
