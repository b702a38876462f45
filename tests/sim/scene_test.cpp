// Checks by rays what each scene promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "sim/laser_model.hpp"
#include "sim/own_vehicle.hpp"
#include "sim/world.hpp"
#include "tests/sim/made_world.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

Scenario scenario_of(SceneKind kind) {
  Scenario s = small_scenario();
  s.scene = kind;
  s.duration_s = 8;
  s.drive.accelerate_s = 1;
  s.drive.speed = 6;
  s.street.curve_deg = 0;
  s.drive.lane_offset_m =
      kind == SceneKind::Street || kind == SceneKind::Canyon || kind == SceneKind::Tunnel ? 1.75 : 0;
  if (kind == SceneKind::Traffic) {
    s.street.road_width_m = 14;
    s.street.zebra_at_m = 60;
    s.street.moving_cars = 4;
    s.drive.lane_offset_m = 5.25;
  }
  if (kind == SceneKind::Targets) s.drive.stand_s = 8;
  return s;
}

class EveryScene : public testing::TestWithParam<SceneKind> {};

TEST_P(EveryScene, IsValidAndLeavesTheVehicleRoom) {
  const Scenario s = scenario_of(GetParam());
  ASSERT_EQ(s.validate(), "");
  const Made made(s);
  std::size_t hits = 0;
  for (double t = 0; t < 8; t += 0.25) {
    const Pose T = made.motion.T_enu_body(made.at(t));
    // Nothing is in the vehicle's way along its flanks and across its roof, from hub height to above the masts.
    for (const double side : {-1.02, 1.02})
      for (const double up : {-0.4, 0.3, 1.0, 1.7, 2.1}) {
        const Seen seen = made.look(t, T * Vec3{side, -2.2, up}, T.R * Vec3{0, 1, 0}, 60);
        hits += seen.is_hit;
        EXPECT_TRUE(!seen.is_hit || seen.surface == 1 || seen.distance_m > 4.4)
            << "at " << t << " s, " << made.world.surfaces()[seen.surface];
      }
    const Seen above = made.look(t, T * Vec3{0, -2.2, 2.0}, T.R * Vec3{0, 1, 0}, 60);
    EXPECT_TRUE(!above.is_hit || above.distance_m > 4.4) << made.world.surfaces()[above.surface];
  }
  EXPECT_GT(hits, 5u);
}

TEST_P(EveryScene, HasGroundBelowAndManySurfacesAround) {
  const Made made(scenario_of(GetParam()));
  const Pose T = made.motion.T_enu_body(made.at(4));
  std::set<std::uint16_t> met;
  for (int i = 0; i < 360; ++i)
    for (double el = -60; el < 60; el += 3) {
      const double a = radians(i), e = radians(el);
      const Seen seen =
          made.look(4, T * Vec3{0, 0, 2.2}, Vec3{std::cos(e) * std::sin(a), std::cos(e) * std::cos(a), std::sin(e)});
      if (seen.is_hit) {
        met.insert(seen.surface);
        EXPECT_LT(seen.surface, made.world.surfaces().size());
        EXPECT_GT(seen.reflectance, 0.01f);
        EXPECT_LT(seen.reflectance, 1.0f);
      } else {
        EXPECT_GT(el, -3.0) << "a hole in the ground at azimuth " << i;
      }
    }
  EXPECT_GT(met.size(), 12u);
  EXPECT_EQ(met.count(0), 0u);
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene,
                         testing::Values(SceneKind::Street, SceneKind::Square, SceneKind::Canyon, SceneKind::Alley,
                                         SceneKind::Traffic, SceneKind::Tunnel, SceneKind::Targets));

TEST(Alley, WallsKeepTheirDistanceOnBothSides) {
  Scenario s = scenario_of(SceneKind::Alley);
  s.alley.near_m = 2;
  s.alley.far_m = 5;
  const Made made(s);
  double least = 100, most = 0;
  for (double t = 0; t < 8; t += 0.1) {
    const Pose T = made.motion.T_enu_body(made.at(t));
    for (const double side : {-1.0, 1.0}) {
      const Seen seen = made.look(t, T * Vec3{side * 1.0, 0, 2.2}, T.R * Vec3{side, 0, 0});
      ASSERT_TRUE(seen.is_hit);
      least = std::min(least, seen.distance_m + 1.0);
      most = std::max(most, seen.distance_m + 1.0);
    }
  }
  EXPECT_GT(least, 2.0 - 0.35) << "sills and pipes stand out by a hand";
  EXPECT_LT(least, 3.2);
  EXPECT_GT(most, 3.6);
  EXPECT_LT(most, 5.2);
}

TEST(Traffic, OthersMoveAndSaySo) {
  const Made made(scenario_of(SceneKind::Traffic));
  std::size_t moving = 0, seen_moving = 0;
  for (std::size_t i = 0; i < made.world.surfaces().size(); ++i) {
    const bool says = made.world.surfaces()[i].starts_with("moving");
    EXPECT_EQ(made.world.is_moving(static_cast<std::uint16_t>(i)), says) << made.world.surfaces()[i];
    moving += says;
  }
  EXPECT_EQ(moving, 2u * 4 + 3 + 14 + 4);
  std::set<std::uint16_t> met;
  for (double t = 0; t < 8; t += 0.5) {
    const Pose T = made.motion.T_enu_body(made.at(t));
    for (int i = 0; i < 720; ++i)
      for (const double el : {-12.0, -6.0, -3.0}) {
        const double a = radians(i * 0.5), e = radians(el);
        const Seen seen =
            made.look(t, T * Vec3{0, 0, 2.2}, Vec3{std::cos(e) * std::sin(a), std::cos(e) * std::cos(a), std::sin(e)});
        if (seen.is_hit && made.world.is_moving(seen.surface)) {
          ++seen_moving;
          met.insert(seen.surface);
        }
      }
  }
  EXPECT_GT(seen_moving, 200u);
  const auto meets = [&](const std::string& kind) {
    return std::any_of(met.begin(), met.end(),
                       [&](std::uint16_t s) { return made.world.surfaces()[s].find(kind) != std::string::npos; });
  };
  EXPECT_TRUE(meets("oncoming"));
  EXPECT_TRUE(meets("overtaking"));
  EXPECT_TRUE(meets("pedestrian"));
  EXPECT_TRUE(meets("crossing"));
  // A moment extrapolated over the time of a packet agrees with the moment itself.
  const Moment base = made.world.moment(made.at(3)), later = made.world.moment(made.at(3.001)),
               guessed = made.world.moment(base, made.at(3.001), later.T_enu_body);
  for (std::size_t i = 0; i < later.T_enu_mover.size(); ++i)
    EXPECT_LT(length(later.T_enu_mover[i].p - guessed.T_enu_mover[i].p), 1e-6);
}

TEST(RoadUsers, DriveWhereTheScenarioSaysAndAreMoving) {
  Scenario s = scenario_of(SceneKind::Street);
  s.street.furnished = false;
  s.road_users = {{RoadUserKind::Lorry, 12, -1.5, 5, 1}, {RoadUserKind::Car, 60, -1.5, -7, 10}};
  ASSERT_EQ(s.validate(), "");
  const Made made(s);
  const auto meets = [&](double t, double along, double up) {
    // A ray from the right across the road.
    const CentreLine& line = made.motion.centre_line();
    const Vec3 from = line.place(along, 2.5, up), to = line.place(along, -3.4, up);
    return made.look(t, from, to - from, 8);
  };
  for (const double t : {0.0, 1.5, 3.0}) {
    const double middle = 12 + 5 * t;
    for (const double off : {-6.1, 0.0, 3.6}) {
      const Seen seen = meets(t, middle + off, 2.5);
      ASSERT_TRUE(seen.is_hit) << "at " << t << " s, " << off << " m from the lorry's middle";
      EXPECT_EQ(made.world.surfaces()[seen.surface], "moving lorry of the list 0");
      EXPECT_TRUE(made.world.is_moving(seen.surface));
      EXPECT_EQ(seen.material, Material::Tarpaulin);
      EXPECT_NEAR(seen.distance_m, 2.5 + 1.5 - 1.25, 1e-3);
    }
    EXPECT_EQ(meets(t, middle + 6.0, 1.5).material, Material::CarPaint) << "the cab is in front";
    EXPECT_FALSE(meets(t, middle - 6.4, 2.5).is_hit);
    EXPECT_FALSE(meets(t, middle + 6.4, 2.5).is_hit);
    const Seen car = meets(t, 60 - 7 * t, 0.6);
    EXPECT_EQ(made.world.surfaces()[car.surface], "moving car of the list 1");
    EXPECT_LT(car.albedo.g, 0.02f) << "paint 10 is black";
  }
}

TEST(CarPaints, AreSnowWhiteOrBlackWhereTheScenarioSaysSo) {
  Scenario s = scenario_of(SceneKind::Street);
  s.street.parked_cars = 12;
  const auto share_of_extremes = [](const Made& made) {
    std::map<bool, std::size_t> extreme, white;
    for (double t = 0; t < 8; t += 0.5) {
      const Pose T = made.motion.T_enu_body(made.at(t));
      for (int i = 0; i < 720; ++i)
        for (const double el : {-25.0, -15.0, -9.0}) {
          const double a = radians(i * 0.5), e = radians(el);
          const Seen seen = made.look(t, T * Vec3{0, 0, 2.2},
                                      Vec3{std::cos(e) * std::sin(a), std::cos(e) * std::cos(a), std::sin(e)});
          if (seen.surface < 2 || seen.material != Material::CarPaint) continue;
          ++extreme[seen.albedo.g > 0.92f || seen.albedo.g < 0.013f];
          ++white[seen.albedo.g > 0.92f];
        }
    }
    EXPECT_GT(extreme[true] + extreme[false], 500u);
    return std::pair{static_cast<double>(extreme[true]) / static_cast<double>(extreme[true] + extreme[false]),
                     static_cast<double>(white[true]) / static_cast<double>(white[true] + white[false])};
  };
  EXPECT_EQ(share_of_extremes(Made(s)).first, 0);
  s.street.car_paints = CarPaints::BlackAndWhite;
  const auto [extreme, white] = share_of_extremes(Made(s));
  EXPECT_GT(extreme, 0.9) << "all but the seams of doors";
  EXPECT_GT(white, 0.2);
  EXPECT_LT(white, 0.8);
}

TEST(DetectionRange, LeavesOutWhatIsTooWeakAndNothingElse) {
  Scenario s = scenario_of(SceneKind::Street);
  s.street.car_paints = CarPaints::BlackAndWhite;
  s.noise = false;
  s.street.leaves_per_tree = 0;
  const Made made(s);
  Scenario limited = s;
  limited.laser.detection_range_m = 12;
  ASSERT_EQ(limited.validate(), "");
  const Scanner all(s, made.motion, made.world), some(limited, made.motion, made.world);
  std::size_t kept = 0, missing = 0, dark_missing = 0;
  for (std::size_t packet = 0; packet < 1500; packet += 7) {
    const FiredPacket whole = all.fire(packet), part = some.fire(packet);
    std::size_t next = 0;
    for (const TrueReturn& r : whole.returns) {
      const bool is_kept = next < part.returns.size() && part.returns[next].fired_gps_ns == r.fired_gps_ns &&
                           part.returns[next].channel == r.channel;
      next += is_kept;
      const Vec3 hit{r.east, r.north, r.up}, beam = hit - whole.scanner_enu;
      const double t = static_cast<double>(r.fired_gps_ns - made.scenario.sensors_begin_gps_ns()) * 1e-9;
      const Seen seen = made.look(t, whole.scanner_enu, beam);
      if (seen.surface != r.surface || std::abs(seen.distance_m - length(beam)) > 0.02) continue;
      double reflectance = 0;
      for (const std::uint8_t coded : r.albedo) {
        const double x = coded / 255.0;
        reflectance += (x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4)) / 3;
      }
      const double range = length(beam), strength = reflectance * std::abs(dot(seen.normal, beam)) / range;
      const double least = 0.1 * range * range / (12.0 * 12.0);
      const bool is_mirror = seen.material == Material::SignFace;  // it sends the light back to the scanner
      if (is_mirror || std::abs(strength / least - 1) > 0.3) {
        EXPECT_EQ(is_kept, is_mirror || strength > least) << made.world.surfaces()[r.surface];
      }
      kept += is_kept;
      missing += !is_kept;
      dark_missing += !is_kept && r.albedo[1] < 40;
    }
    EXPECT_EQ(next, part.returns.size()) << "a limited scanner measures nothing that another does not";
  }
  EXPECT_GT(kept, 10'000u);
  EXPECT_GT(missing, 1000u);
  EXPECT_GT(dark_missing, 20u);
}

TEST(Targets, SpheresStandWhereTheTruthSays) {
  const Made made(scenario_of(SceneKind::Targets));
  ASSERT_EQ(made.world.targets().size(), 10u);
  const Pose T = made.motion.T_enu_body(made.at(2));
  std::size_t visible = 0;
  for (const SphereTarget& target : made.world.targets()) {
    const Vec3 eye = T * Vec3{0, 0, 2.4}, to = target.centre - eye;
    EXPECT_TRUE(target.radius_m == 0.145 || target.radius_m == 0.0725);
    EXPECT_EQ(made.world.surfaces()[target.surface].rfind("target", 0), 0u);
    const Seen seen = made.look(2, eye, to);
    if (seen.surface != target.surface) continue;  // another target or the mast is in front of it
    ++visible;
    EXPECT_NEAR(seen.distance_m, length(to) - target.radius_m, 2e-4);
    // A ray beside the middle still hits the sphere, at its radius.
    const Vec3 across = normalised(cross(to, Vec3{0, 0, 1}));
    const Seen edge = made.look(2, eye, target.centre + 0.7 * target.radius_m * across - eye);
    ASSERT_EQ(edge.surface, target.surface);
    const Vec3 hit = eye + edge.distance_m * normalised(target.centre + 0.7 * target.radius_m * across - eye);
    EXPECT_NEAR(length(hit - target.centre), target.radius_m, 3e-4);
  }
  EXPECT_GE(visible, 7u);
}

TEST(Tunnel, IsDarkInsideAndLitByLamps) {
  Scenario s = scenario_of(SceneKind::Tunnel);
  s.tunnel.from_m = 5;
  s.tunnel.length_m = 60;
  const Made made(s);
  const auto road_light = [&](double along) {
    const Vec3 above = made.motion.centre_line().place(along, -1.0, 1.5);
    const Seen seen = made.look(0, above, {0, 0, -1});
    EXPECT_TRUE(seen.is_hit);
    return seen.colour.g / seen.reflectance;
  };
  const double outside = road_light(-10), inside = road_light(35);
  EXPECT_GT(outside, 0.7);
  EXPECT_LT(inside, 0.3 * outside);
  EXPECT_GT(inside, 0.02);
  const Seen up = made.look(0, made.motion.centre_line().place(35, 0, 2), {0, 0, 1});
  ASSERT_TRUE(up.is_hit) << "a roof";
  EXPECT_NEAR(up.distance_m, s.tunnel.height_m - 2, 0.01);
}

TEST(Scenarios, YoungKeysAtTheirDefaultsLeaveTheFingerprintAlone) {
  Scenario s;
  EXPECT_EQ(s.fingerprint(), "69a607c417fe441e");
  s.targets.large = 3;
  EXPECT_NE(s.fingerprint(), "69a607c417fe441e");
  EXPECT_NE(s.text().find("targets.large=3"), std::string::npos);
  EXPECT_EQ(s.text().find("targets.small"), std::string::npos);
}

TEST(Scenarios, WhatASceneCannotBeIsRefused) {
  Scenario s = scenario_of(SceneKind::Tunnel);
  s.street.curve_deg = 3;
  EXPECT_NE(s.validate().text().find("curve_deg"), std::string::npos);
  s = scenario_of(SceneKind::Traffic);
  s.street.road_width_m = 8;
  s.drive.lane_offset_m = 1;
  EXPECT_NE(s.validate().text().find("road_width_m"), std::string::npos);
  s = scenario_of(SceneKind::Alley);
  s.alley.near_m = 6;
  EXPECT_NE(s.validate().text().find("near_m"), std::string::npos);
}

}  // namespace
}  // namespace hueline::sim
