#include "fusion/colouring.hpp"

#include <gmock/gmock.h>

#include <numbers>

#include "drive.hpp"

/// The whole stage on a small drive with known truth.
namespace hueline::fusion {
namespace {
using namespace hueline::test;
using std::numbers::pi;

constexpr double kInterval = 0.25;

/// Red grows to the right, green downwards inside each lens, blue names the exposure.
Image ramp_image(double blue) {
  return make_image(306, 6 * 256, PixelFormat::Rgb8, [blue](std::uint32_t x, std::uint32_t y, int c) {
    return c == 0 ? 0.8 * x : c == 1 ? 0.9 * (y % 256) : blue;
  });
}

struct TestDrive {
  Drive drive{Motion{}};
  RigGeometry rig;
  Colouring::Config config;
  double until = 2.0;
  std::vector<int> lost;                       ///< exposures never delivered
  std::function<Image(int)> image = [](int i) { return ramp_image(10.0 * i); };
  std::function<void(Exposure&)> alter = [](Exposure&) {};
  int per_batch = 64;
  double packet_rate = 100;
};

struct Outcome {
  std::vector<ColouredPoint> points;
  Geodetic origin;
  ColouringCounts counts;
  std::vector<Fault> faults;
  std::vector<Vector3> truth_base;
};

/// Feeds everything in the order of its time, as it would arrive: images 80 ms late.
Outcome run(const TestDrive& setup) {
  Outcome outcome;
  Colouring colouring(setup.config, setup.rig, [&](CloudBlock&& block) {
    outcome.origin = block.origin;
    outcome.points.insert(outcome.points.end(), block.points.begin(), block.points.end());
  });
  const auto batches = scan(setup.drive, setup.rig.lasers[0], 0.2, setup.until, setup.packet_rate, setup.per_batch, &outcome.truth_base);
  std::size_t next_batch = 0;
  int next_exposure = 0;
  const int ticks = static_cast<int>((setup.until + 0.3) * 200);
  for (int i = 0; i <= ticks; ++i) {
    const double t = i / 200.0;
    colouring.add(setup.drive.solution(t));
    while (next_batch < batches.size() && batches[next_batch].time < at(t)) colouring.add(batches[next_batch++]);
    const double mid = 0.1 + kInterval * next_exposure;
    if (mid + 0.08 < t) {
      if (std::find(setup.lost.begin(), setup.lost.end(), next_exposure) == setup.lost.end()) {
        Exposure exposure = make_exposure(static_cast<std::uint32_t>(next_exposure), mid, setup.image(next_exposure));
        setup.alter(exposure);
        colouring.add(exposure);
      }
      ++next_exposure;
    }
    colouring.advance(at(t));
  }
  colouring.flush();
  outcome.counts = colouring.counts();
  outcome.faults = colouring.take_faults();
  return outcome;
}

/// The pixel where the point must lie in the exposure and lens that claim it, by the tests' own mathematics.
bool true_pixel(const TestDrive& setup, const Vector3& p_base, int exposure, int lens, Eigen::Vector2d& pixel, double onto_sphere = 0) {
  const double t = 0.1 + kInterval * exposure;
  const Matrix3 R = setup.drive.motion().R_base_body(t);
  const Vector3 p_body = R.transpose() * (p_base - setup.drive.motion().position(t));
  const auto& mount = setup.rig.head.T_body_head;
  Vector3 p_head = mount.rotation.toRotationMatrix().transpose() * (p_body - mount.translation);
  if (onto_sphere > 0) p_head *= onto_sphere / p_head.norm();
  return project_truth(setup.rig.head.lenses[static_cast<std::size_t>(lens)], p_head, pixel);
}

class BothModels : public testing::TestWithParam<LensModel> {};
INSTANTIATE_TEST_SUITE_P(Lens, BothModels, testing::Values(LensModel::Brown, LensModel::KannalaBrandt));

TEST_P(BothModels, PlacesAndProjectsWhereTheTruthIs) {
  TestDrive setup;
  setup.rig = ladybug_rig(GetParam());
  const Outcome out = run(setup);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  double worst_place = 0, worst_pixel = 0, worst_colour = 0;
  std::size_t coloured = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    const Vector3 truth = setup.drive.point_in(out.origin, out.truth_base[i]);
    worst_place = std::max(worst_place, (truth - Vector3(p.east, p.north, p.up)).norm());
    if (p.state != ColourState::Direct && p.state != ColourState::Neighbour) continue;
    ++coloured;
    Eigen::Vector2d pixel;
    ASSERT_TRUE(true_pixel(setup, out.truth_base[i], static_cast<int>(p.exposure), p.lens, pixel)) << i;
    worst_pixel = std::max(worst_pixel, (pixel - Eigen::Vector2d(p.u, p.v)).norm());
    if (p.state == ColourState::Direct) {
      worst_colour = std::max({worst_colour, std::abs(p.red - 0.8 * p.u), std::abs(p.green - 0.9 * p.v),
                               std::abs(p.blue - 10.0 * p.exposure)});
    }
  }
  EXPECT_GT(coloured, out.points.size() * 7 / 10);
  EXPECT_LT(worst_place, 1e-4);
  EXPECT_LT(worst_pixel, 0.01);
  EXPECT_LT(worst_colour, 1.1);  // two roundings to whole numbers
  RecordProperty("worst_place_m", std::to_string(worst_place));
  RecordProperty("worst_pixel", std::to_string(worst_pixel));
  std::printf("worst place %.2e m, worst pixel %.2e px, coloured %zu of %zu\n", worst_place, worst_pixel, coloured, out.points.size());
}

TEST(SphereMethod, PanoramaPixelAndRawPixelFollowThePaper) {
  TestDrive setup;
  setup.rig = ladybug_rig(LensModel::KannalaBrandt);
  setup.config.method = ColourMethod::Panorama;
  const Outcome out = run(setup);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  double worst_pixel = 0, worst_colour = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    if (p.state != ColourState::Direct) continue;
    const double t = 0.1 + kInterval * p.exposure;
    const auto& mount = setup.rig.head.T_body_head;
    const Vector3 p_body = setup.drive.motion().R_base_body(t).transpose() * (out.truth_base[i] - setup.drive.motion().position(t));
    const Vector3 s = mount.rotation.toRotationMatrix().transpose() * (p_body - mount.translation);
    // Step 4: theta = acos(z / |p|) = y_p / r, azimuth = x_p / r with r = width / 2 pi; forward in the middle, clockwise.
    const double r = 8000 / (2 * pi);
    double u = 3999.5 + r * std::atan2(-s.y(), s.x());
    if (u < -0.5) u += 8000;
    const double v = r * std::acos(s.z() / s.norm()) - 0.5;
    worst_pixel = std::max({worst_pixel, std::abs(std::remainder(u - p.u, 8000.0)), std::abs(v - p.v)});
    Eigen::Vector2d raw;
    ASSERT_TRUE(true_pixel(setup, out.truth_base[i], static_cast<int>(p.exposure), p.lens, raw, 20.0));
    worst_colour = std::max({worst_colour, std::abs(p.red - 0.8 * raw.x()), std::abs(p.green - 0.9 * raw.y())});
  }
  EXPECT_LT(worst_pixel, 0.01);
  EXPECT_LT(worst_colour, 1.1);
  std::printf("worst panorama pixel %.2e px\n", worst_pixel);
}

}  // namespace
}  // namespace hueline::fusion
