#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "sim/earth.hpp"
#include "sim/ins_model.hpp"
#include "sim/lens_optics.hpp"
#include "sim/pps_model.hpp"
#include "sim/scenario.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {
namespace {

TEST(Earth, KnownPlaces) {
  // The axes of the ellipsoid, computed by hand.
  const Vec3 equator = ecef_from_geodetic({0, 0, 0});
  EXPECT_DOUBLE_EQ(equator.x, 6378137.0);
  const Vec3 pole = ecef_from_geodetic({kPi / 2, 1.0, 0});
  EXPECT_NEAR(pole.z, 6356752.314245, 1e-6);
  EXPECT_NEAR(std::hypot(pole.x, pole.y), 0, 1e-9);
  const Vec3 east = ecef_from_geodetic({0, kPi / 2, 100});
  EXPECT_NEAR(east.y, 6378237.0, 1e-8);
}

TEST(Earth, ThereAndBack) {
  for (double latitude = -1.57; latitude < 1.571; latitude += 0.157)
    for (const double height : {-100.0, 0.0, 600.0, 9000.0}) {
      const Vec3 p = ecef_from_geodetic({latitude, 2.1, height});
      const GeodeticPlace g = geodetic_from_ecef(p);
      EXPECT_NEAR(g.latitude, latitude, 1e-14);
      EXPECT_NEAR(g.height, height, 2e-9);
      EXPECT_LT(length(ecef_from_geodetic(g) - p), 3e-9);
    }
}

TEST(Attitude, ByHand) {
  // Heading 90 deg: forward (body y) is east, right (body x) is south.
  const Mat3 east = R_enu_body(0, 0, kPi / 2);
  EXPECT_NEAR((east * Vec3{0, 1, 0}).x, 1, 1e-15);
  EXPECT_NEAR((east * Vec3{1, 0, 0}).y, -1, 1e-15);
  // Nose up: forward has a positive up part. Right side down: right has a negative up part.
  EXPECT_NEAR((R_enu_body(0, 0.1, 0) * Vec3{0, 1, 0}).z, std::sin(0.1), 1e-15);
  EXPECT_NEAR((R_enu_body(0.1, 0, 0) * Vec3{1, 0, 0}).z, -std::sin(0.1), 1e-15);
  const auto back = attitude_of(R_enu_body(0.02, -0.03, 5.1));
  EXPECT_NEAR(back[0], 0.02, 1e-15);
  EXPECT_NEAR(back[1], -0.03, 1e-15);
  EXPECT_NEAR(back[2], 5.1, 1e-15);
}

TEST(Lenses, LookWhereALadybugLooks) {
  const auto lenses = ladybug5_lenses();
  ASSERT_EQ(lenses.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const TrueLens lens = true_lens(lenses[i], i, LensModel::KannalaBrandt, 612, 512);
    const Vec3 axis = lens.T_head_lens.R * Vec3{0, 0, 1};
    const double azimuth = -72.0 * static_cast<double>(i);  // clockwise seen from above
    const Vec3 expected = i < 5 ? Vec3{std::cos(radians(azimuth)), std::sin(radians(azimuth)), 0} : Vec3{0, 0, 1};
    EXPECT_LT(degrees(angle_between(axis, expected)), 0.5) << "lens " << i;
    // A lens is 60 mm from the centre along its own axis, which no other order of rotations gives.
    EXPECT_LT(degrees(angle_between(lens.T_head_lens.p, expected)), 2.0) << "lens " << i;
    // The sensors lie on their sides.
    if (i < 5) {
      EXPECT_LT((lens.T_head_lens.R * Vec3{1, 0, 0}).z, -0.999);
    }
  }
}

TEST(Lenses, ProjectionInvertsRay) {
  for (const LensModel model : {LensModel::KannalaBrandt, LensModel::Brown})
    for (std::size_t i = 0; i < 6; ++i) {
      const TrueLens lens = true_lens(ladybug5_lenses()[i], i, model, 612, 512);
      for (double v = 0; v < 512; v += 73)
        for (double u = 0; u < 612; u += 61) {
          const auto ray = lens.ray(u, v);
          ASSERT_TRUE(ray) << i << " " << u << " " << v;
          EXPECT_NEAR(length(*ray), 1, 1e-15);
          const auto pixel = lens.project(*ray);
          ASSERT_TRUE(pixel);
          EXPECT_NEAR(pixel->u, u, 1e-10);
          EXPECT_NEAR(pixel->v, v, 1e-10);
        }
    }
}

TEST(Lenses, ModelsByHand) {
  TrueLens lens;
  lens.width = lens.height = 1001;
  lens.focal_x = lens.focal_y = 400;
  lens.centre_x = lens.centre_y = 500;
  lens.theta_max = 1.2;
  lens.distortion = {0.1, 0, 0, 0, 0};
  // theta 0.5 rad to the right: theta_d = 0.5 (1 + 0.1 * 0.25) = 0.5125.
  const auto fisheye = lens.project({std::sin(0.5), 0, std::cos(0.5)});
  EXPECT_NEAR(fisheye->u, 500 + 400 * 0.5125, 1e-12);
  EXPECT_NEAR(fisheye->v, 500, 1e-12);
  EXPECT_FALSE(lens.project({1, 0, -0.1}));
  // Brown at (0.5, 0.2): r2 = 0.29, radial 1.029, p1 = 0.01: x += 2 * 0.01 * 0.1, y += 0.01 (0.29 + 0.08).
  lens.model = LensModel::Brown;
  lens.distortion = {0.1, 0, 0.01, 0, 0};
  const auto brown = lens.project({0.5, 0.2, 1});
  EXPECT_NEAR(brown->u, 500 + 400 * (0.5 * 1.029 + 0.002), 1e-12);
  EXPECT_NEAR(brown->v, 500 + 400 * (0.2 * 1.029 + 0.0037), 1e-12);
}

TEST(Motion, VelocityIsTheDerivativeOfPlaceAndNothingJumps) {
  Scenario scenario;
  const Motion motion(scenario);
  constexpr GpsNs h = 1'000'000;  // 1 ms
  Vec3 last_acceleration;
  bool first = true;
  for (GpsNs t = scenario.begin_gps_ns() + h; t < scenario.end_gps_ns(); t += 7 * h) {
    const Vec3 a = motion.state(t - h).T_enu_body.p, b = motion.state(t).T_enu_body.p,
               c = motion.state(t + h).T_enu_body.p;
    const Vec3 v = motion.state(t).velocity_enu;
    EXPECT_LT(length(500.0 * (c - a) - v), 1e-4);
    const Vec3 acceleration = 1e6 * (c - 2.0 * b + a);
    if (!first) {
      EXPECT_LT(length(acceleration - last_acceleration), 0.15) << t;
    }
    last_acceleration = acceleration;
    first = false;
  }
  const TrueState start = motion.state(scenario.begin_gps_ns());
  EXPECT_NEAR(length(start.velocity_enu), 0, 1e-12);
  const GpsNs middle = scenario.sensors_begin_gps_ns() + 16'000'000'000;
  EXPECT_NEAR(std::hypot(motion.state(middle).velocity_enu.x, motion.state(middle).velocity_enu.y), 8.0, 0.11);
  // 1.75 m right of the centre line at the start, heading 37 deg.
  EXPECT_NEAR(start.T_enu_body.p.x, 1.75 * std::cos(radians(37)), 1e-9);
  EXPECT_NEAR(start.T_enu_body.p.y, -1.75 * std::sin(radians(37)), 1e-9);
  EXPECT_NEAR(start.T_enu_body.p.z, 0.8, 1e-12);
  EXPECT_NEAR(degrees(motion.state(scenario.end_gps_ns()).heading), 37 + 14, 1e-9);
  EXPECT_NEAR(motion.along(scenario.end_gps_ns()), 8.0 * (32 - 2 - 9 + 4.5), 1e-9);
}

Scenario there_and_back() {
  Scenario s;
  s.duration_s = 75;
  s.street.road_width_m = 14;
  s.street.curve_deg = 30;
  s.street.curve_start_m = 40;
  s.street.curve_length_m = 40;
  s.drive.lane_offset_m = 5.5;
  s.drive.turns = {{.at_m = 120, .for_s = 10}, {.at_m = 20, .for_s = 12}};
  return s;
}

TEST(Motion, TurnsAreDrivenThereAndBackAndNothingJumps) {
  for (const double lane : {5.5, -4.0}) {
    Scenario scenario = there_and_back();
    scenario.drive.lane_offset_m = lane;
    ASSERT_EQ(scenario.validate(), "");
    const Motion motion(scenario);
    constexpr GpsNs h = 1'000'000;
    Vec3 last_acceleration;
    double turned = motion.turned_heading(scenario.begin_gps_ns()), way = 0, wheel = 0, nearest = 1e9, farthest = 0;
    for (GpsNs t = scenario.begin_gps_ns() + h; t < scenario.end_gps_ns(); t += h) {
      const Vec3 a = motion.state(t - h).T_enu_body.p, b = motion.state(t).T_enu_body.p,
                 c = motion.state(t + h).T_enu_body.p;
      const TrueState state = motion.state(t);
      EXPECT_LT(length(500.0 * (c - a) - state.velocity_enu), 1e-4);
      const Vec3 acceleration = 1e6 * (c - 2.0 * b + a);
      if (t > scenario.begin_gps_ns() + h) {
        EXPECT_LT(length(acceleration - last_acceleration), 0.05) << t;
      }
      EXPECT_LT(length(acceleration), 4.6) << "that of braking";
      last_acceleration = acceleration;
      const double speed = std::hypot(state.velocity_enu.x, state.velocity_enu.y), heading = motion.turned_heading(t);
      // The vehicle moves forward and its nose points along the motion.
      if (speed > 0.01) {
        EXPECT_LT(std::hypot(state.velocity_enu.x / speed - std::sin(heading),
                             state.velocity_enu.y / speed - std::cos(heading)),
                  1e-9);
      }
      way += 1e-3 * speed;
      wheel += 1e-3 * speed - 0.7 * (heading - turned);
      turned = heading;
      nearest = std::min(nearest, motion.along(t));
      farthest = std::max(farthest, motion.along(t));
    }
    EXPECT_NEAR(motion.way(scenario.end_gps_ns(), 0), way, 0.01);
    EXPECT_NEAR(motion.way(scenario.end_gps_ns(), 0.7), wheel, 0.01) << "a wheel 0.7 m to the right";
    EXPECT_NEAR(farthest, 120 + std::abs(lane), 1e-3);
    EXPECT_EQ(motion.length_m(), 120 + std::abs(lane));
    EXPECT_NEAR(nearest, 0, 1e-9);
    EXPECT_NEAR(turned - motion.turned_heading(scenario.begin_gps_ns()), radians(30) - std::copysign(2 * kPi, lane),
                0.5)
        << "on the way out again";
    // In the middle of the first way back the vehicle is on the other side of the road and drives against the line.
    const Vec3 back = motion.state(scenario.sensors_begin_gps_ns() + 38'000'000'000).T_enu_body.p;
    const double s = motion.along(scenario.sensors_begin_gps_ns() + 38'000'000'000);
    const Vec3 expected = motion.centre_line().place(s, -lane);
    EXPECT_LT(std::hypot(back.x - expected.x, back.y - expected.y), 1e-9);
  }
}

TEST(Motion, TurnsThatCannotBeDrivenAreRefused) {
  const auto said = [](auto change) {
    Scenario s = there_and_back();
    change(s);
    return s.validate().text();
  };
  EXPECT_THAT(said([](Scenario& s) { s.drive.lane_offset_m = 1.75; }),
              testing::HasSubstr("drive.lane_offset_m is the radius"));
  EXPECT_THAT(said([](Scenario& s) { s.drive.turns[0].at_m = 30; }),
              testing::HasSubstr("drive.turns[0].at_m must lie 36 m or more beyond the start"));
  EXPECT_THAT(said([](Scenario& s) { s.drive.turns[1].at_m = 100; }),
              testing::HasSubstr("drive.turns[1].at_m must lie 36 m or more before the last turn"));
  EXPECT_THAT(said([](Scenario& s) { s.drive.turns[0].at_m = 84; }), testing::HasSubstr("on a straight"));
  EXPECT_THAT(said([](Scenario& s) { s.duration_s = 50; }),
              testing::HasSubstr("duration_s is too short for drive.turns: at least"));
  EXPECT_THAT(said([](Scenario& s) { s.drive.turns.pop_back(); }),
              testing::HasSubstr("duration_s is too long for drive.turns"));
}

TEST(Ins, WithoutNoiseIsTheTruthInTheVehiclesOwnLevel) {
  Scenario scenario;
  scenario.noise = false;
  scenario.duration_s = 12;
  const Motion motion(scenario);
  const auto samples = simulate_ins(scenario, motion);
  ASSERT_EQ(samples.size(), static_cast<std::size_t>(200 * (4 + 12 + 1) + 1));
  const GeodeticPlace origin = scene_origin(scenario);
  const InsSample& s = samples.back();
  const Vec3 p_scene =
      transposed(R_ecef_enu(origin)) *
      (ecef_from_geodetic({s.latitude_rad, s.longitude_rad, s.ellipsoidal_height_m}) - ecef_from_geodetic(origin));
  EXPECT_LT(length(p_scene - motion.state(s.gps_ns).T_enu_body.p), 5e-9);
  // Meridian convergence: at a distance x to the east, north differs from north at the origin by x tan(latitude) / R.
  const double expected = motion.state(s.gps_ns).heading + p_scene.x * std::tan(origin.latitude) / 6.39e6;
  EXPECT_NEAR(s.heading_rad, expected, 3e-8);
}

TEST(Ins, ErrorsHaveTheSizeThatTheScenarioAsksFor) {
  Scenario scenario;
  scenario.duration_s = 3000;
  scenario.ins.rate_hz = 1;
  scenario.ins.correlation_s = 5;
  Scenario quiet = scenario;
  quiet.noise = false;
  const auto noisy = simulate_ins(scenario, Motion(scenario));
  const auto truth = simulate_ins(quiet, Motion(quiet));
  double heading = 0, height = 0;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    heading += std::pow(noisy[i].heading_rad - truth[i].heading_rad, 2);
    height += std::pow(noisy[i].ellipsoidal_height_m - truth[i].ellipsoidal_height_m, 2);
  }
  const auto n = static_cast<double>(noisy.size());
  EXPECT_NEAR(degrees(std::sqrt(heading / n)), 0.02, 0.002);
  EXPECT_NEAR(std::sqrt(height / n), 0.015, 0.0015);
}

/// Errors of position and heading at the end of an outage over many drives, and what the POS claims of them.
struct OutageEnd {
  double place_rms = 0, heading_rms = 0, claimed_place = 0, claimed_heading = 0;
  std::uint8_t before = 0, inside = 0, after = 0;
};
OutageEnd outage_end(InsGrade grade, double for_s, double speed) {
  OutageEnd out;
  constexpr int kDrives = 60, kRate = 4;
  for (int i = 0; i < kDrives; ++i) {
    Scenario scenario;
    scenario.seed = 100 + static_cast<std::uint64_t>(i);
    scenario.duration_s = for_s + 60;
    scenario.street.curve_deg = 0;
    scenario.drive.speed = speed;
    scenario.ins.rate_hz = kRate;
    scenario.ins.grade = grade;
    scenario.ins.outages = {{10, for_s}};
    Scenario usual = scenario;
    usual.ins.outages.clear();
    const Motion motion(scenario);
    const auto with = simulate_ins(scenario, motion), without = simulate_ins(usual, motion);
    const auto last = static_cast<std::size_t>((scenario.lead_in_s + 10 + for_s) * kRate - 1);
    const double north = (with[last].latitude_rad - without[last].latitude_rad) * 6.37e6;
    out.place_rms += north * north / kDrives;
    out.heading_rms +=
        std::pow(std::remainder(with[last].heading_rad - without[last].heading_rad, 2 * kPi), 2) / kDrives;
    out.claimed_place = std::sqrt(std::pow(with[last].sigma[1], 2) - std::pow(without[last].sigma[1], 2));
    out.claimed_heading = std::sqrt(std::pow(with[last].sigma[8], 2) - std::pow(without[last].sigma[8], 2));
    out.before = with[40].status;
    out.inside = with[last - 1].status;
    out.after = with.back().status;
    EXPECT_EQ(with[40].latitude_rad, without[40].latitude_rad);
    EXPECT_NEAR(with.back().sigma[0], without.back().sigma[0], 1e-3) << "satellites bring it back";
    EXPECT_FALSE(with[last].has_gnss);
    EXPECT_TRUE(with.back().has_gnss);
  }
  out.place_rms = std::sqrt(out.place_rms);
  out.heading_rms = std::sqrt(out.heading_rms);
  return out;
}

TEST(Ins, DriftsInAnOutageAsItsGradeAndClaimsWhatIsTrue) {
  for (const auto& [grade, least, most] :
       {std::tuple{InsGrade::PosLv220, 0.15, 0.9}, std::tuple{InsGrade::PosLv420, 0.05, 0.4},
        std::tuple{InsGrade::SpanCpt, 0.8, 6.0}}) {
    const OutageEnd minute = outage_end(grade, 60, 16), short_one = outage_end(grade, 10, 16);
    EXPECT_GT(minute.place_rms, least);
    EXPECT_LT(minute.place_rms, most);
    EXPECT_GT(minute.place_rms, 3 * short_one.place_rms) << "errors grow faster than the time";
    // Sixty drives determine a sigma to a tenth. The claim with a wheel sensor does not separate along and across.
    EXPECT_NEAR(minute.place_rms / minute.claimed_place, 1, 0.35);
    EXPECT_NEAR(minute.heading_rms / minute.claimed_heading, 1, 0.3);
    EXPECT_NEAR(short_one.place_rms / short_one.claimed_place, 1, 0.35);
    EXPECT_EQ(minute.before, 3);
    EXPECT_EQ(short_one.inside, 6);
    EXPECT_EQ(minute.after, 3);
  }
  EXPECT_EQ(outage_end(InsGrade::SpanCpt, 120, 16).inside, 2) << "too wide to be called good";
}

TEST(Pps, JitterAndSpikes) {
  Scenario scenario;
  scenario.duration_s = 3600;
  const auto errors = simulate_pps(scenario);
  ASSERT_EQ(errors.size(), 3606u);
  int late = 0;
  double sum2 = 0, n = 0;
  for (const auto e : errors) {
    if (std::llabs(e) > 8000) ++late;
    if (std::llabs(e) < 6000) sum2 += static_cast<double>(e) * static_cast<double>(e), ++n;
  }
  EXPECT_NEAR(std::sqrt(sum2 / n), 1500, 120);
  EXPECT_GT(late, 25);
  EXPECT_LT(late, 100);
  scenario.noise = false;
  for (const auto e : simulate_pps(scenario)) EXPECT_EQ(e, 0);
}

TEST(Scenario, ComplaintsNameTheKeyAndTheRange) {
  Scenario scenario;
  EXPECT_EQ(scenario.validate(), "");
  const std::string before = scenario.fingerprint();
  scenario.laser.mount.rot_x_deg = 400;
  EXPECT_EQ(scenario.validate(), "laser.mount.rot_x_deg is 400; allowed: a number from -360 to 360 deg");
  EXPECT_NE(scenario.fingerprint(), before);
  scenario = {};
  scenario.camera.lens_width = 513;
  EXPECT_NE(scenario.validate().text().find("lens_width"), std::string::npos);
  scenario = {};
  scenario.ins.rate_hz = 300;
  EXPECT_NE(scenario.validate().text().find("ins.rate_hz"), std::string::npos);
  scenario = {};
  scenario.camera.lenses[3].rot_z += 1e-12;
  EXPECT_NE(scenario.fingerprint(), before);
}

}  // namespace
}  // namespace hueline::sim
