#include "fusion/panorama.hpp"

#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <numbers>

#include "core/geodesy.hpp"
#include "tests/fusion/drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;
using std::numbers::pi;

PanoramaShape ladybug_shape() { return {}; }

TEST(Panorama, AxesByHand) {
  const Panorama p(ladybug_shape());
  // Seen from inside, 8000 x 4000: forward is in the middle, right (head -y) is a quarter of the width to the right of
  // it, up is at the upper edge.
  EXPECT_NEAR((*p.pixel_of({{1, 0, 0}}) - Eigen::Vector2d(3999.5, 1999.5)).norm(), 0, 1e-9);
  EXPECT_NEAR((*p.pixel_of({{0, -1, 0}}) - Eigen::Vector2d(5999.5, 1999.5)).norm(), 0, 1e-9);
  EXPECT_NEAR((*p.pixel_of({{0, 1, 0}}) - Eigen::Vector2d(1999.5, 1999.5)).norm(), 0, 1e-9);
  EXPECT_NEAR(p.pixel_of({{0, 0, 5}})->y(), -0.5, 1e-9);
  EXPECT_NEAR(p.pixel_of({{0, 0, -5}})->y(), 3999.5, 1e-9);
  EXPECT_NEAR(p.pixel_of({{1, 0, -1}})->y(), 2999.5, 1e-9);
  EXPECT_FALSE(p.pixel_of({{0, 0, 0}}));

  PanoramaShape other = ladybug_shape();
  other.is_clockwise = false;
  other.forward_column = -0.5;  // the paper's own counting: azimuth anticlockwise from the first column
  const Panorama q(other);
  EXPECT_NEAR(q.pixel_of({{0, 1, 0}})->x(), 1999.5, 1e-9);
  EXPECT_NEAR(q.pixel_of({{0, -1, 0}})->x(), 5999.5, 1e-9);
  EXPECT_NEAR(q.pixel_of({{1, 0, 0}})->x(), -0.5, 1e-9);
}

TEST(Panorama, DirectionAndPixelAreInverse) {
  for (const bool clockwise : {true, false}) {
    for (const double forward : {-0.5, 0.0, 1234.25, 7999.0}) {
      PanoramaShape shape = ladybug_shape();
      shape.is_clockwise = clockwise;
      shape.forward_column = forward;
      const Panorama p(shape);
      for (double u = -0.4; u < 7999.5; u += 333.3) {
        for (double v = 0; v < 3999; v += 222.1) {
          const Eigen::Vector2d back = *p.pixel_of(p.direction_of({u, v}));
          EXPECT_NEAR(std::remainder(back.x() - u, 8000), 0, 1e-8);
          EXPECT_GE(back.x(), -0.5);
          EXPECT_LT(back.x(), 7999.5);
          EXPECT_NEAR(back.y(), v, 1e-8);
        }
      }
    }
  }
}

/// papers/sphere-fusion, steps 1 to 4, from WGS84 to the panorama pixel.
TEST(SphereChain, EqualsThePaperFromEcefToPixel) {
  const Geodetic origin{0.84, 0.2, 560};
  const GeographicLib::LocalCartesian level(origin.latitude * 180 / pi, origin.longitude * 180 / pi,
                                            origin.ellipsoidal_height);
  const Attitude attitude{0.03, -0.05, 2.1};
  Transform<Body, CameraHead> T_body_head;
  T_body_head.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(pi / 2 + 0.01, Vector3::UnitZ()) *
                                            Eigen::AngleAxisd(0.02, Vector3::UnitX()));
  T_body_head.translation = {0.2, -0.4, 1.1};
  const Panorama panorama(ladybug_shape());
  for (int i = 0; i < 50; ++i) {
    const double lat = origin.latitude + 2e-6 * std::sin(i), lon = origin.longitude + 3e-6 * std::cos(2 * i),
                 h = 558 + 0.3 * i;
    // This project: ECEF -> ENU -> Body -> head -> pixel.
    const Transform<Enu, Body> T_enu_body{rotation_enu_body(attitude), Vector3(0.5, 0.25, -0.125)};
    const Point<Ecef> p_ecef = to_ecef({lat, lon, h});
    const Point<CameraHead> p_head = (T_enu_body * T_body_head).inverse() * (ecef_from_enu(origin).inverse() * p_ecef);
    const Eigen::Vector2d ours = *panorama.pixel_of({p_head.xyz});
    // The paper: GeographicLib for step 1, and the matrices of steps 2 and 3 written out.
    Vector3 p_enu;
    level.Forward(lat * 180 / pi, lon * 180 / pi, h, p_enu.x(), p_enu.y(), p_enu.z());
    const Vector3 p_imu = paper_enu_from_imu(attitude.roll, attitude.pitch, attitude.heading).transpose() *
                          (p_enu - Vector3(0.5, 0.25, -0.125));
    const Vector3 s = T_body_head.rotation.toRotationMatrix().transpose() * (p_imu - T_body_head.translation);
    const double r = 8000 / (2 * pi);
    double x_p = r * std::fmod(2 * pi + std::atan2(s.y(), s.x()), 2 * pi);  // equation (8), wrapped
    const double y_p = r * std::acos(s.z() / s.norm());
    x_p = 3999.5 - x_p;  // forward in the middle, clockwise
    if (x_p < -0.5) x_p += 8000;
    EXPECT_NEAR(std::remainder(ours.x() - x_p, 8000.0), 0, 1e-5);
    EXPECT_NEAR(ours.y(), y_p - 0.5, 1e-5);
  }
}

TEST(SphereChain, AttitudeAxesByHand) {
  // The paper's rows for single angles. At heading 90 degrees, forward is east. With positive pitch, forward rises.
  // With positive roll, the right side sinks.
  EXPECT_LT((paper_enu_from_imu(0, 0, pi / 2) * Vector3::UnitY() - Vector3::UnitX()).norm(), 1e-12);
  EXPECT_GT((paper_enu_from_imu(0, 0.1, 0) * Vector3::UnitY()).z(), 0.09);
  EXPECT_LT((paper_enu_from_imu(0.1, 0, 0) * Vector3::UnitX()).z(), -0.09);
  for (const Attitude& a : {Attitude{0.1, 0.2, 0.3}, Attitude{-0.4, 0.05, 4.0}}) {
    EXPECT_LT((rotation_enu_body(a).toRotationMatrix() - paper_enu_from_imu(a.roll, a.pitch, a.heading)).norm(), 1e-12);
  }
}

TEST(StitchedPanorama, PixelToLensAndBack) {
  for (const LensModel model : {LensModel::Brown, LensModel::KannalaBrandt}) {
    const CameraHeadGeometry head = ladybug_rig(model).head;
    const StitchedPanorama stitched(head);
    int seen = 0, all = 0;
    for (double u = 0; u < 8000; u += 161.7) {
      for (double v = 20; v < 3980; v += 97.3) {
        ++all;
        const auto lens = stitched.lens_pixel({u, v});
        if (!lens) continue;
        ++seen;
        const Eigen::Vector2d back = *stitched.panorama_pixel(*lens);
        EXPECT_NEAR(std::remainder(back.x() - u, 8000) * std::sin(pi * v / 4000), 0, 1e-5);
        EXPECT_NEAR(back.y(), v, 1e-5);
        // Independent of StitchedPanorama: the point on the sphere of 20 m, projected by the tests' own formulas.
        const double azimuth = -(u - 3999.5) * 2 * pi / 8000, polar = (v + 0.5) * pi / 4000;
        Eigen::Vector2d truth;
        project_truth(
            head.lenses[static_cast<std::size_t>(lens->lens)],
            20 * Vector3(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)),
            truth);
        EXPECT_LT((truth - lens->pixel).norm(), 1e-8);
      }
    }
    EXPECT_GT(seen, all * 6 / 10);
    EXPECT_LT(seen, all);  // the nadir hole
    EXPECT_FALSE(stitched.lens_pixel({4000, 3999}));
  }
}

/// The figure that papers/sphere-fusion gives for the parallax of stitching: 11 px at 4.4 m for a panorama stitched for
/// 20 m.
TEST(StitchedPanorama, ParallaxIsThePapers) {
  CameraHeadGeometry head = ladybug_rig(LensModel::KannalaBrandt).head;
  const StitchedPanorama stitched(head);
  // Between two lenses, the lens's centre is seen at the steepest angle: half of 72 degrees off the lens's axis.
  const Vector3 direction(std::cos(0.6), std::sin(-0.6), 0);
  const auto at_true_distance = stitched.lens_pixel_of_point({4.4 * direction});
  const Eigen::Vector2d shown = *stitched.panorama_pixel(*at_true_distance);
  const double error = std::abs(shown.x() - stitched.panorama().pixel_of({direction})->x());
  EXPECT_NEAR(error, 8000 / (2 * pi) * 0.06 * std::sin(0.6) * (1 / 4.4 - 1 / 20.0), 0.5);
  EXPECT_GT(error, 5);
  EXPECT_LT(error, 12);
}

}  // namespace
}  // namespace hueline::fusion
