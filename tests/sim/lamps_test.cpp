// Night: lamps and headlights light what they reach, throw shadows and move with their vehicles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/truth_file.hpp"
#include "tests/sim/made_world.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

Scenario night_street() {
  Scenario s = small_scenario();
  s.noise = false;
  s.duration_s = 8;
  s.drive.accelerate_s = 1;
  s.drive.speed = 6;
  s.street.curve_deg = 0;
  s.street.tree_spacing_m = 1000;
  s.street.parked_cars = 0;
  s.street.moving_cars = 0;
  s.street.daylight = 0.001;
  return s;
}

/// Returns the light that reaches a level place, for a reflectance of 1, in green.
double light_at(const Made& made, double t, Vec3 place) {
  const Seen seen = made.look(t, place + Vec3{0, 0, 0.3}, {0, 0, -1});
  EXPECT_TRUE(seen.is_hit);
  return static_cast<double>(seen.own.g) / static_cast<double>(seen.albedo.g);
}

TEST(Night, DaylightDimsSunAndSkyAlike) {
  Scenario s = night_street();
  const Made night(s);
  s.street.daylight = 1;
  const Made day(s);
  const CentreLine& line = day.motion.centre_line();
  for (double along = 3; along < 30; along += 4) {
    const Vec3 road = line.place(along, -1);
    EXPECT_NEAR(light_at(night, 0, road), 0.001 * light_at(day, 0, road), 1e-6);
    const Vec3 up{0.3, 0.1 * along, 2};
    EXPECT_NEAR(night.look(0, road, up).colour.b, 0.001f * day.look(0, road, up).colour.b, 1e-6f);
  }
}

TEST(Night, AStreetLampLightsTheRoadAsTheDistanceSays) {
  Scenario s = night_street();
  s.street.daylight = 0;
  s.street.lamp_light = 1;
  const Made made(s);
  const CentreLine& line = made.motion.centre_line();
  // The lamps on the right stand every 27 m from s = -45 on, 7.12 m high, with their glass 1.45 m towards the road.
  const double s0 = -45 + 2 * 27, lateral = 3.5 + 0.45 - 1.45, high = 0.12 + 7.1 - 0.03;
  for (const double aside : {0.0, 1.0, 3.0, 5.0}) {
    const Vec3 place = line.place(s0 + aside, lateral);
    const double d2 = aside * aside + high * high, cosine = high / std::sqrt(d2);
    const double direct = 0.80 * cosine * cosine / (0.25 + d2), got = light_at(made, 0, place);
    EXPECT_GT(got, direct);
    EXPECT_LT(got, 1.6 * direct + 0.002) << "light of other lamps, and what the street reflects";
  }
  const Seen glass = made.look(0, line.place(s0, lateral, 2), Vec3{0, 0, 1});
  EXPECT_EQ(glass.material, Material::LampGlass);
  EXPECT_GT(glass.colour.r, 1) << "a lamp saturates a camera that exposes for day, and more so at night";
}

TEST(Night, ThingsThrowShadowsInTheLightOfLamps) {
  Scenario s = night_street();
  s.street.daylight = 0;
  s.street.lamp_light = 1;
  s.street.pole_spacing_m = 1000;  // one lamp on the right, at s = -45
  s.road_users = {{RoadUserKind::Lorry, -37, 2.2, 0, 1}};
  const Made with(s);
  s.road_users.clear();
  const Made without(s);
  const CentreLine& line = with.motion.centre_line();
  // The lorry stands 2 to 14 m beyond the lamp; its far side keeps the light from the road behind it.
  const Vec3 behind = line.place(-29.5, 2.2), before = line.place(-46, 2.2);
  EXPECT_LT(light_at(with, 0, behind), 0.5 * light_at(without, 0, behind));
  EXPECT_NEAR(light_at(with, 0, before), light_at(without, 0, before), 1e-9);
}

TEST(Night, HeadlightsLightTheRoadAheadAndMoveWithTheVehicle) {
  Scenario s = night_street();
  s.street.daylight = 0;
  s.drive.headlights = 0.1;
  const Made made(s);
  const CentreLine& line = made.motion.centre_line();
  const auto when_at = [&](double along) {
    double t = 0;
    while (made.motion.along(made.at(t)) < along) t += 0.01;
    return t;
  };
  const double t10 = when_at(10), t22 = when_at(22);
  const Vec3 ahead = line.place(24, 1.75);
  EXPECT_GT(light_at(made, t10, ahead), 1e-4);
  EXPECT_LT(light_at(made, t22, ahead), 0.05 * light_at(made, t10, ahead)) << "below the bonnet's edge";
  EXPECT_EQ(light_at(made, t22, line.place(18, 1.75)), 0) << "behind the lamps it is dark";
  // A white surface 10 m ahead that faces the lamps would have the light that the key says. The rear of a car has its
  // place there.
  s.road_users = {{RoadUserKind::Lorry, 10 + 2.2 + 10 + 6.2, 1.75, 0, 2}};
  const Made wall(s);
  const Pose T = wall.motion.T_enu_body(wall.at(t10));
  double most = 0;
  for (double x = -1; x <= 1; x += 0.1)
    for (double up = 0.35; up < 3; up += 0.1) {
      const Seen seen = wall.look(t10, T * Vec3{x, 8, up}, T.R * Vec3{0, 1, 0}, 10);
      if (seen.material == Material::Tarpaulin)
        most = std::max(most, static_cast<double>(seen.own.r) / static_cast<double>(seen.albedo.r));
    }
  EXPECT_GT(most, 0.002);
  EXPECT_LT(most, 0.1);
}

TEST(Night, OncomingLightsGlareAndTailLightsAreRed) {
  Scenario s = night_street();
  s.street.daylight = 0;
  s.street.car_lights = 0.1;
  s.road_users = {{RoadUserKind::Car, 40, -1.75, -5, 1}, {RoadUserKind::Person, 20, -4, -1, 1}};
  const Made made(s);
  const CentreLine& line = made.motion.centre_line();
  const auto brightest = [&](double from, double towards) {
    Radiance most;
    for (double x = -0.8; x <= 0.8; x += 0.02)
      for (double up = 0.3; up < 0.9; up += 0.02) {
        const Seen seen =
            made.look(0, line.place(from, -1.75 + x, up), line.place(towards, 0) - line.place(from, 0), 9);
        if (made.world.is_moving(seen.surface) && seen.colour.r > most.r) most = seen.colour;
      }
    return most;
  };
  const Radiance front = brightest(34, 40), rear = brightest(46, 40);
  EXPECT_GT(front.r, 5);
  EXPECT_GT(front.b, 0.7f * front.r);
  EXPECT_GT(rear.r, 0.2f);
  EXPECT_LT(rear.b, 0.2f * rear.r);
  EXPECT_GT(light_at(made, 0, line.place(29, -1.75)), 20 * light_at(made, 0, line.place(50, -1.75)))
      << "the road in front of the car, and the road behind it";
}

TEST(Night, TheTruthOfADarkReturnHasItsDigits) {
  const TemporaryFolder folder("hueline-dark");
  TrueReturn dark, bright;
  dark.light = {3.1e-5f, 7.7e-4f, 1.23e-3f};
  bright.light = {3.9f, 0.5f, 1.0f / 16384};
  for (const bool is_fine : {false, true}) {
    TruthHeader header;
    header.has_fine_light = is_fine;
    const std::string file = folder.path() + "/truth.bin";
    TruthWriter writer(file, header);
    writer.packet(0, {}, std::array{dark, bright});
    ASSERT_TRUE(writer.close().ok());
    auto reader = TruthReader::open(file);
    ASSERT_TRUE(reader.ok());
    const auto read = reader->next_packet();
    ASSERT_TRUE(read.ok());
    for (std::size_t k = 0; k < 3; ++k) {
      const float step = is_fine ? 6.1e-5f / 512 : 6.1e-5f;
      EXPECT_NEAR((*read)[0].light[k], dark.light[k], 0.51f * step);
      EXPECT_NEAR((*read)[1].light[k], bright.light[k], 3.1e-5f);
    }
  }
}

}  // namespace
}  // namespace hueline::sim
