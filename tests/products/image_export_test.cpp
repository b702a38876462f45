#include "products/image_export.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "products/recorded_jpeg.hpp"
#include "storage/image_file.hpp"
#include "storage/photo_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::products {
namespace {

using storage::Bytes;
using storage::ByteView;
using test::TemporaryFolder;

constexpr int kWidth = 64, kHeight = 48;

std::vector<std::uint8_t> pixels() {
  std::vector<std::uint8_t> out;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      for (const int one : {4 * u, 5 * v, 2 * (u + v)}) out.push_back(static_cast<std::uint8_t>(one));
  return out;
}

Bytes jpeg() { return *storage::encode_jpeg({pixels().data(), kWidth, kHeight}, 90, {}); }

/// The same as a camera sends it: without Huffman tables, behind a head, with padding.
Bytes packet_of(const Bytes& whole, bool has_tables) {
  Bytes out(24, std::byte{7});
  for (std::size_t i = 0; i < whole.size();) {
    const bool is_segment = i >= 2 && whole[i] == std::byte{0xFF} && whole[i + 1] != std::byte{0xDA};
    const std::size_t size =
        i == 0 ? 2
        : is_segment
            ? 2 + (std::to_integer<std::size_t>(whole[i + 2]) << 8 | std::to_integer<std::size_t>(whole[i + 3]))
            : whole.size() - i;
    if (has_tables || !is_segment || whole[i + 1] != std::byte{0xC4})
      storage::append(out, ByteView(whole).subspan(i, size));
    i += size;
  }
  out.resize(out.size() + 5);
  return out;
}

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(RecordedJpeg, IsTheFileInThePacket) {
  const Bytes whole = jpeg();
  EXPECT_TRUE(recorded_jpeg(packet_of(whole, true), kWidth, kHeight) == whole);
  EXPECT_TRUE(recorded_jpeg(packet_of(whole, false), kWidth, kHeight) == whole) << "with the tables put in";
  EXPECT_TRUE(recorded_jpeg(whole, kWidth / 2, kHeight).empty()) << "a plane of a quarter";
}

TEST(RecordedJpeg, TakesNoBrokenBytesForAFile) {
  const Bytes packet = packet_of(jpeg(), true);
  EXPECT_TRUE(recorded_jpeg({}, kWidth, kHeight).empty());
  for (std::size_t size = 0; size + 8 < packet.size(); ++size) {
    const Bytes found = recorded_jpeg(ByteView(packet).first(size), kWidth, kHeight);
    EXPECT_TRUE(found.empty()) << "cut at " << size;
  }
  for (std::size_t i = 0; i < packet.size(); ++i)  // any answer, but no read beyond the end
    for (const int value : {0, 0xFF, 0xD8, 0xDA}) {
      Bytes broken = packet;
      broken[i] = static_cast<std::byte>(value);
      (void)recorded_jpeg(broken, kWidth, kHeight);
    }
}

class Images : public testing::Test {
 protected:
  Images() {
    fusion::LensMount lens;
    lens.name = "front camera/1";
    lens.camera = 3;
    lens.intrinsics.width = kWidth;
    lens.intrinsics.height = kHeight;
    lens.intrinsics.focal_px = {50, 50};
    lens.intrinsics.principal_point_px = {31.5, 23.5};
    lens.intrinsics.distortion = {-0.1, 0.01, 0, 0, 0};
    head_.lenses.push_back(lens);
    for (int i = 0; i < 30; ++i) {
      InsSolution solution;
      solution.time = begin_ + std::chrono::milliseconds(100 * i);
      solution.position = {48.1 * std::numbers::pi / 180, 11.5 * std::numbers::pi / 180, 500};
      solution.is_good = true;
      trajectory_.add(solution);
    }
  }
  Exposure exposure(std::uint32_t index) const {
    Exposure one;
    one.camera = 3;
    one.index = index;
    one.exposure_mid = begin_ + std::chrono::milliseconds(150 + 100 * index);
    one.timing = ExposureTiming::CameraClock;
    one.image.sensor = 3;
    one.image.packet_sequence = 1000 + index;
    one.image.width = kWidth;
    one.image.height = kHeight;
    one.image.stride = 3 * kWidth;
    one.image.format = PixelFormat::Rgb8;
    one.image.is_complete = true;
    const auto colours = pixels();
    one.image.buffer = Buffer::copy_of(std::as_bytes(std::span(colours)));
    return one;
  }
  Packet packet(std::uint32_t index, bool has_tables) const {
    Packet out;
    out.sensor = 3;
    out.sequence = 1000 + index;
    out.kind = PacketKind::Wire;
    out.bytes = Buffer::copy_of(packet_of(jpeg(), has_tables));
    return out;
  }
  GpsTime begin_ = from_gps_week(2400, std::chrono::seconds(1000));
  fusion::CameraHeadGeometry head_;
  fusion::Trajectory trajectory_{{}};
  TemporaryFolder folder_;
};

TEST_F(Images, JpegsAreWrittenAsTheCameraMadeThem) {
  ImageExport images(folder_ / ".", head_, {}, {});
  images.set_origin(*trajectory_.origin());
  for (const std::uint32_t index : {0u, 1u, 2u}) {
    if (index < 2) images.add(packet(index, index == 0));
    images.add(exposure(index));
    ASSERT_TRUE(images.settle(exposure(index), trajectory_).ok());
  }
  ASSERT_TRUE(images.finish().ok());
  EXPECT_EQ(images.counts().pictures, 3u);
  EXPECT_EQ(images.counts().copied, 2u);
  const Bytes whole = jpeg();
  const std::string want(reinterpret_cast<const char*>(whole.data()), whole.size());
  EXPECT_TRUE(contents(folder_ / "images/front_camera_1/000000.jpg") == want);
  EXPECT_TRUE(contents(folder_ / "images/front_camera_1/000001.jpg") == want);
  EXPECT_FALSE(contents(folder_ / "images/front_camera_1/000002.jpg") == want) << "no packet was there";
}

TEST_F(Images, WhatCannotBePlacedIsCounted) {
  ImageExport::Config config;
  config.pixels = LensPixels::Pinhole;
  ImageExport images(folder_ / ".", head_, {}, config);
  images.set_origin(*trajectory_.origin());
  Exposure without_time = exposure(0), incomplete = exposure(1), late = exposure(50);
  without_time.timing = ExposureTiming::Unmatched;
  incomplete.image.is_complete = false;
  for (const Exposure& one : {without_time, incomplete, late, exposure(2)}) {
    images.add(packet(one.index, true));
    images.add(one);
    ASSERT_TRUE(images.settle(one, trajectory_).ok());
  }
  ASSERT_TRUE(images.finish().ok());
  const auto& counts = images.counts();
  EXPECT_EQ(counts.exposures, 4u);
  EXPECT_EQ(counts.without_time, 1u);
  EXPECT_EQ(counts.incomplete, 1u);
  EXPECT_EQ(counts.without_pose, 1u);
  EXPECT_EQ(counts.pictures, 1u);
  EXPECT_EQ(counts.copied, 0u) << "an undistorted picture is no copy";
}

TEST_F(Images, TablesThatCannotBeWrittenAreNotThere) {
  fusion::LensMount fisheye = head_.lenses[0];
  fisheye.name = "fisheye";
  fisheye.camera = 4;
  fisheye.intrinsics.model = fusion::LensModel::KannalaBrandt;
  fisheye.intrinsics.distortion = {};
  head_.lenses.push_back(fisheye);
  for (const char* file : {"transforms.json", "points.ply"}) std::ofstream(folder_ / file) << "of an earlier export";
  ImageExport images(folder_ / ".", head_, {}, {});
  images.set_origin(*trajectory_.origin());
  images.add(exposure(0));
  ASSERT_TRUE(images.settle(exposure(0), trajectory_).ok());
  ASSERT_TRUE(images.finish().ok());
  EXPECT_EQ(images.missing_tables().size(), 1u);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "sparse/0/images.txt"));
  for (const char* file : {"transforms.json", "points.ply"}) EXPECT_FALSE(std::filesystem::exists(folder_ / file));
}

TEST(LensPicture, SaysTheModelsOfColmap) {
  fusion::CameraIntrinsics lens;
  lens.width = 100, lens.height = 80;
  lens.focal_px = {70, 71};
  lens.principal_point_px = {49.5, 39.5};
  EXPECT_EQ(colmap_camera(lens).model, "PINHOLE");
  EXPECT_EQ(colmap_camera(lens).parameters, (std::vector<double>{70, 71, 50, 40}));
  lens.distortion = {0.1, 0.2, 0.3, 0.4, 0};
  EXPECT_EQ(colmap_camera(lens).model, "OPENCV");
  lens.distortion[4] = 0.5;
  EXPECT_EQ(colmap_camera(lens).model, "FULL_OPENCV");
  EXPECT_EQ(colmap_camera(lens).parameters.size(), 12u);
  EXPECT_EQ(colmap_camera(lens).parameters[8], 0.5);
  lens.model = fusion::LensModel::KannalaBrandt;
  EXPECT_EQ(colmap_camera(lens).model, "OPENCV_FISHEYE");
  EXPECT_EQ(colmap_camera(lens).parameters.size(), 8u);
}

TEST(LensPicture, SaysWhereItShowsAPoint) {
  fusion::LensMount mount;  // a fisheye that sees more than a half-space
  mount.intrinsics.model = fusion::LensModel::KannalaBrandt;
  mount.intrinsics.width = 400, mount.intrinsics.height = 400;
  mount.intrinsics.focal_px = {100, 100};
  mount.intrinsics.principal_point_px = {199.5, 199.5};
  const auto at = [](double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    return Point<Lens>{{5 * std::sin(angle), 0, 5 * std::cos(angle)}};
  };
  const LensPicture recorded(mount, LensPixels::Recorded), pinhole(mount, LensPixels::Pinhole);
  EXPECT_NEAR(recorded.pixel(at(60))->x(), 199.5 + 100 * std::numbers::pi / 3, 1e-9);
  EXPECT_TRUE(recorded.pixel(at(86)));
  EXPECT_FALSE(recorded.pixel(at(95))) << "in the image, but behind the lens";
  EXPECT_NEAR(pinhole.pixel(at(45))->x(), pinhole.intrinsics().principal_point_px.x() + 100, 1e-9);
  EXPECT_FALSE(pinhole.pixel(at(86)));
}

TEST(OmegaPhiKappa, AreThoseOfAPictureTakenDownwards) {
  // A camera that looks straight down, its columns to the east: the axes of its picture are those of the map.
  Eigen::Matrix3d R;
  R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  OmegaPhiKappa angles = omega_phi_kappa(R);
  EXPECT_NEAR(std::abs(angles.omega) + std::abs(angles.phi) + std::abs(angles.kappa), 0, 1e-12);
  // Turned by 30 degrees anticlockwise, seen from above.
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(std::numbers::pi / 6, Eigen::Vector3d::UnitZ()) * R;
  EXPECT_NEAR(omega_phi_kappa(turned).kappa, std::numbers::pi / 6, 1e-12);
}

}  // namespace
}  // namespace hueline::products
