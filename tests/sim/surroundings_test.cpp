// A photograph around the scene: every direction must show the right pixel, and nothing but what cameras see may
// change.
#include "sim/surroundings.hpp"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "sim/world.hpp"
#include "tests/sim/small_scenario.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Makes an image in which red grows with the column and green with the row.
void write_ramp(const std::filesystem::path& file, int width, int height, int quality = 100) {
  std::vector<unsigned char> rgb;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const double share : {double(x) / (width - 1), double(y) / (height - 1), 0.5})
        rgb.push_back(static_cast<unsigned char>(std::lround(255 * share)));
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  const tjhandle encoder = tjInitCompress();
  ASSERT_EQ(tjCompress2(encoder, rgb.data(), width, 0, height, TJPF_RGB, &jpeg, &size, TJSAMP_444, quality,
                        TJFLAG_ACCURATEDCT),
            0);
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(jpeg), static_cast<std::streamsize>(size));
  tjFree(jpeg);
  tjDestroy(encoder);
}

Vec3 direction(double azimuth, double elevation) {
  return {std::sin(azimuth) * std::cos(elevation), std::cos(azimuth) * std::cos(elevation), std::sin(elevation)};
}
double srgb(float linear) { return linear <= 0.0031308f ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

TEST(Surroundings, EveryDirectionHasItsPixel) {
  const TemporaryFolder folder("surroundings");
  const auto file = std::filesystem::path(folder.path()) / "ramp.jpg";
  constexpr int kWidth = 64, kHeight = 32;  // an error of half a pixel is 0.008 of red or 0.016 of green
  write_ramp(file, kWidth, kHeight);
  const double centre_deg = 30;
  const auto loaded = Surroundings::load(file, centre_deg);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  double red_off = 0, green_off = 0, count = 0;
  for (double elevation = -1.45; elevation <= 1.5; elevation += 0.1)
    for (double from_centre = -3.05; from_centre <= 3.1; from_centre += 0.1) {
      const Radiance c = (*loaded)->at(direction(from_centre + centre_deg / 360 * kTurn, elevation), 0.001f);
      const double red = srgb(c.r) - ((from_centre / kTurn + 0.5) * kWidth - 0.5) / (kWidth - 1);
      const double green = srgb(c.g) - ((0.5 - elevation / (kTurn / 2)) * kHeight - 0.5) / (kHeight - 1);
      EXPECT_NEAR(red, 0, 0.012) << from_centre << " " << elevation << ": JPEG's rounding";
      EXPECT_NEAR(green, 0, 0.012) << from_centre << " " << elevation;
      red_off += red, green_off += green, ++count;
    }
  EXPECT_NEAR(red_off / count, 0, 0.001);
  EXPECT_NEAR(green_off / count, 0, 0.001);
  // A wide cone sees the mean. Straight up and down no column is defined.
  EXPECT_NEAR(srgb((*loaded)->at(direction(centre_deg / 360 * kTurn, 0), 0.5f).g), 0.5, 0.05);
  for (const double up : {-1.0, 1.0}) EXPECT_NEAR(srgb((*loaded)->at({0, 0, up}, 0.001f).g), 0.5 - up / 2, 0.01);
}

TEST(Surroundings, AnotherFileOrAnotherTurnIsAnotherDrive) {
  const TemporaryFolder folder("surroundings_identity");
  const auto a = std::filesystem::path(folder.path()) / "a.jpg", b = std::filesystem::path(folder.path()) / "b.jpg";
  write_ramp(a, 64, 32);
  write_ramp(b, 64, 32, 90);
  Scenario plain, one, same, turned, other;
  one.surroundings = *Surroundings::load(a, 0);
  same.surroundings = *Surroundings::load(a, 0);
  turned.surroundings = *Surroundings::load(a, 1);
  other.surroundings = *Surroundings::load(b, 0);
  EXPECT_EQ(one.fingerprint(), same.fingerprint());
  for (const Scenario* s : {&plain, &turned, &other}) EXPECT_NE(one.fingerprint(), s->fingerprint());
}

TEST(Surroundings, WhatIsNoPanoramaIsRefusedWithTheReason) {
  const TemporaryFolder folder("surroundings_refused");
  const auto file = std::filesystem::path(folder.path()) / "a.jpg";
  EXPECT_EQ(Surroundings::load(file, 0).error().code, ErrorCode::Io);
  write_ramp(file, 64, 48);
  EXPECT_NE(Surroundings::load(file, 0).error().message.find("64 x 48"), std::string::npos);
  std::ofstream(file, std::ios::binary) << "not a picture";
  EXPECT_NE(Surroundings::load(file, 0).error().message.find("no JPEG"), std::string::npos);
  write_ramp(file, 64, 32);
  std::filesystem::resize_file(file, 300);
  EXPECT_EQ(Surroundings::load(file, 0).error().code, ErrorCode::Malformed);
}

TEST(Surroundings, ARealPhotographStandsBehindTheSceneAndLeavesItAlone) {
  HUELINE_REQUIRE_DATA("panorama/examplepano.jpg");
  Scenario plain = small_scenario(), real = plain;
  plain.scene = real.scene = SceneKind::Square;
  const auto loaded = Surroundings::load(data_file, 90);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  real.surroundings = *loaded;
  const Motion motion(plain);
  const World without(plain, motion), with(real, motion);
  const Moment moment = with.moment(plain.sensors_begin_gps_ns());
  int sky = 0, ground = 0;
  for (double azimuth = 0.05; azimuth < kTurn; azimuth += 0.1)
    for (double elevation = -1.2; elevation < 1.5; elevation += 0.05) {
      const World::Ray ray{Vec3{0, 0, 2.2}, direction(azimuth, elevation), 0.01, 1000};
      Seen a, b;
      without.look(moment, std::span(&ray, 1), 0.001f, std::span(&a, 1));
      with.look(moment, std::span(&ray, 1), 0.001f, std::span(&b, 1));
      ASSERT_EQ(a.is_hit, b.is_hit);
      if (!b.is_hit) {
        const Radiance c = (*loaded)->at(ray.direction, 0.001f);
        EXPECT_EQ(b.colour.r, c.r);
        EXPECT_EQ(b.colour.b, c.b);
        ++sky;
      } else if (b.material != Material::CarGlass && b.material != Material::CarPaint) {
        EXPECT_EQ(a.colour.g, b.colour.g);
        EXPECT_EQ(a.surface, b.surface);
        ++ground;
      }
    }
  EXPECT_GT(sky, 500);
  EXPECT_GT(ground, 500);
}

}  // namespace
}  // namespace hueline::sim
