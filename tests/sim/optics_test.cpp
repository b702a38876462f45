// Glass, water, wires and fences: what rays hit, what a camera sees, and what the truth of a laser return is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "sim/laser_model.hpp"
#include "sim/visibility.hpp"
#include "tests/sim/made_world.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

/// A straight street without furniture, noise or sky that changes with direction.
Scenario straight_street() {
  Scenario s = small_scenario();
  s.noise = false;
  s.duration_s = 6;
  s.drive.speed = 6;
  s.street.curve_deg = 0;
  s.street.moving_cars = 0;
  s.street.parked_cars = 0;
  return s;
}

/// Snell's and Fresnel's formulas with angles, unlike the program's.
double reflected(double incidence, double n) {
  const double inside = std::asin(std::sin(incidence) / n);
  if (incidence < 1e-6) return std::pow((n - 1) / (n + 1), 2);
  const double s = std::sin(incidence - inside) / std::sin(incidence + inside),
               p = std::tan(incidence - inside) / std::tan(incidence + inside);
  return 0.5 * (s * s + p * p);
}
double reflected_by_pane(double incidence, double n) {
  const double one = reflected(incidence, n);
  return 2 * one / (1 + one);
}

void expect_near(const Radiance& a, const Radiance& b, float tolerance, const std::string& what) {
  EXPECT_NEAR(a.r, b.r, tolerance) << what;
  EXPECT_NEAR(a.g, b.g, tolerance) << what;
  EXPECT_NEAR(a.b, b.b, tolerance) << what;
}
Radiance blend(double x, const Radiance& a, double y, const Radiance& b) {
  const auto p = static_cast<float>(x), q = static_cast<float>(y);
  return {p * a.r + q * b.r, p * a.g + q * b.g, p * a.b + q * b.b};
}

Scenario glass_street() {
  Scenario s = straight_street();
  s.street.furnished = false;
  s.street.glazed_fronts = 1;
  return s;
}

TEST(Glass, LetsARayThroughAndMirrorsWhatIsInFront) {
  Scenario s = glass_street();
  const Made made(s);
  s.glass = {1.0, 1.0};  // air
  const Made open(s);
  s.glass = {1.52, 0.0};
  const Made opaque(s);
  std::size_t rooms = 0;
  for (double along = 5; along < 60; along += 0.37)
    for (const double side : {-1.0, 1.0})
      for (const double askew : {0.0, 0.6, 1.5}) {
        const CentreLine& line = made.motion.centre_line();
        const Vec3 from = line.place(along, side, 1.6), to = line.place(along + askew, 2 * side, 1.6);
        const Vec3 direction = normalised(to - from);
        const Seen seen = made.look(0, from, direction, 300, 0), bare = open.look(0, from, direction, 300, 0),
                   image = opaque.look(0, from, direction, 300, 0);
        ASSERT_EQ(seen.surface, bare.surface);
        EXPECT_EQ(seen.distance_m, bare.distance_m);
        expect_near(seen.own, bare.colour, 1e-6f, "the surface's own light knows nothing of the pane");
        if (!made.name_of(seen).starts_with("room") && !made.name_of(seen).starts_with("display")) {
          EXPECT_EQ(made.name_of(seen).rfind("pane", 0), std::string::npos) << "no ray ends on a pane";
          continue;
        }
        ++rooms;
        const double share = reflected_by_pane(std::atan(askew), 1.52);
        ASSERT_NEAR(seen.transmitted, (1 - share) * 0.92, 1e-4);
        EXPECT_EQ(bare.transmitted, 1.0f);
        expect_near(seen.colour, blend(seen.transmitted, seen.own, 1, image.colour), 1e-4f, "room and mirror together");
        if (askew == 0) {
          // The mirror shows the other side of the street, which lies on the same ray backwards.
          const Seen other = made.look(0, from, -1.0 * direction, 300, 0);
          if (made.name_of(other).starts_with("facade"))
            expect_near(image.colour, blend(share, other.own, 0, {}), 2e-3f, "what lies opposite");
        }
      }
  EXPECT_GT(rooms, 150u);
}

TEST(Glass, TheScannerMeasuresTheRoomOrNothing) {
  Scenario s = glass_street();
  const Made made(s);
  Scenario dim = s;
  dim.laser.detection_range_m = 14;
  const Scanner scanner(s, made.motion, made.world), weak(dim, made.motion, made.world);
  std::size_t inside = 0, inside_weak = 0, outside = 0, outside_weak = 0;
  const auto count = [&](const FiredPacket& fired, std::size_t& in, std::size_t& out) {
    for (const TrueReturn& r : fired.returns) {
      const std::string& name = made.world.surfaces()[r.surface];
      EXPECT_FALSE(name.starts_with("pane"));
      ++(name.starts_with("room") || name.starts_with("display") ? in : out);
    }
  };
  for (std::size_t packet = 0; packet < scanner.packet_count(); packet += 11) {
    count(scanner.fire(packet), inside, outside);
    count(weak.fire(packet), inside_weak, outside_weak);
  }
  EXPECT_GT(inside, 1000u);
  EXPECT_GT(inside_weak, 100u);
  EXPECT_LT(static_cast<double>(inside_weak) / static_cast<double>(inside),
            0.8 * static_cast<double>(outside_weak) / static_cast<double>(outside));
}

TEST(Glass, HidesWhatItHardlyLetsThrough) {
  const Scenario s = glass_street();
  const Made made(s);
  const Scanner scanner(s, made.motion, made.world);
  const Visibility visibility(s, made.motion, made.world);
  const RigTruth rig = rig_truth(s);
  const Shutter shutter(s);
  std::size_t seen_through = 0, hidden = 0;
  for (std::size_t packet = 0; packet < scanner.packet_count(); packet += 47)
    for (const TrueReturn& r : scanner.fire(packet).returns) {
      if (!made.world.surfaces()[r.surface].starts_with("room")) continue;
      for (std::size_t number = 0; number < 8; ++number)
        for (std::size_t lens = 0; lens < rig.lenses.size(); ++lens) {
          const Sight sight = visibility.sight(r, lens, number);
          if (sight == Sight::Outside) continue;
          const GpsNs t = shutter.mid(number, {});
          const Vec3 eye = (made.motion.T_enu_body(t) * rig.T_body_head * rig.lenses[lens].T_head_lens).p;
          const Vec3 to = Vec3{r.east, r.north, r.up} - eye;
          const Seen seen = made.look(static_cast<double>(t - made.at(0)) * 1e-9, eye, to, length(to) + 1, 0);
          if (seen.surface != r.surface || std::abs(seen.distance_m - length(to)) > 0.005) continue;
          EXPECT_EQ(sight, seen.transmitted < 0.5f ? Sight::Occluded : Sight::Visible) << seen.transmitted;
          ++(seen.transmitted < 0.5f ? hidden : seen_through);
        }
    }
  EXPECT_GT(seen_through, 300u);
  EXPECT_GT(hidden, 20u);
}

Scenario thin_street() {
  Scenario s = straight_street();
  s.street.tree_spacing_m = 1000;
  s.street.stake_spacing_m = 4;
  s.street.fence = Fence::Both;
  s.street.wire_mm = 15;
  s.street.sun_elevation_deg = 90;  // no edge of a shadow crosses a footprint
  return s;
}

TEST(Wires, AreHitWhereTheyAreAndNowhereElse) {
  const Made made(thin_street());
  const CentreLine& line = made.motion.centre_line();
  const double lateral = 3.5 + 0.15 + 0.6 * 2.8;
  std::size_t hits = 0;
  for (int k = 12; k < 24; ++k) {
    const double along = -40 + 4 * k;  // of a stake, 15 mm in radius
    for (const double off : {-0.03, -0.016, -0.014, 0.0, 0.014, 0.016, 0.03}) {
      const Seen seen = made.look(0, line.place(along + off, lateral - 0.7, 1.2),
                                  line.place(along, lateral, 1.2) - line.place(along, lateral - 0.7, 1.2));
      const bool is_stake = made.name_of(seen) == "stakes";
      EXPECT_EQ(is_stake, std::abs(off) < 0.015) << off;
      if (!is_stake) continue;
      ++hits;
      EXPECT_NEAR(seen.distance_m, 0.7 - std::sqrt(0.015 * 0.015 - off * off), 1e-4);
    }
  }
  EXPECT_EQ(hits, 36u);
}

/// Compares the light of a wide cone with the mean of narrow rays over its footprint across a thin vertical thing.
void expect_mean_of_narrow_rays(const Made& made, Vec3 eye, Vec3 to, float cone, const std::string& surface) {
  const Vec3 ahead = normalised(to - eye), across = normalised(cross(ahead, Vec3{0, 0, 1})), up = cross(across, ahead);
  constexpr int kSide = 24;
  Radiance mean;
  std::size_t on = 0;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const double x = cone * ((i + 0.5) / kSide - 0.5), y = cone * ((j + 0.5) / kSide - 0.5);
      const Seen seen = made.look(0, eye, ahead + x * across + y * up, 300, 0);
      mean = blend(1, mean, 1.0 / (kSide * kSide), seen.colour);
      on += made.name_of(seen).starts_with(surface);
    }
  EXPECT_GT(on, 3u) << "the cone meets " << surface;
  EXPECT_LT(on, static_cast<std::size_t>(kSide * kSide - 3));
  expect_near(made.look(0, eye, ahead, 300, cone).colour, mean, 0.03f, surface);
}

TEST(Wires, FillTheShareOfAPixelThatTheyCover) {
  const Made made(thin_street());
  const CentreLine& line = made.motion.centre_line();
  const double lateral = 3.5 + 0.15 + 0.6 * 2.8;
  for (const double along : {12.0, 16.0, 20.0})
    for (const double off : {0.0, 0.01, 0.03}) {
      // In front of the sky, which is smooth: from the ground upwards past the top of a stake.
      const Vec3 eye = line.place(along + off, 1.0, 1.0);
      expect_mean_of_narrow_rays(made, eye, line.place(along + off, lateral, 1.5), 0.025f, "stakes");
    }
}

TEST(Fences, FillTheShareOfAPixelThatTheyCover) {
  const Made made(thin_street());
  const CentreLine& line = made.motion.centre_line();
  for (const double side : {-1.0, 1.0})
    for (const double along : {10.7, 13.3, 21.2})
      expect_mean_of_narrow_rays(made, line.place(along, 0.5 * side, 1.0), line.place(along, 3.7 * side, 0.75), 0.11f,
                                 side > 0 ? "fence right" : "fence left");
}

TEST(Fences, AreMeasuredOnTheirBarsAndThroughTheirGaps) {
  const Scenario s = thin_street();
  const Made made(s);
  const Scanner scanner(s, made.motion, made.world);
  std::size_t bars = 0, link = 0, wires = 0, behind = 0;
  for (std::size_t packet = 0; packet < scanner.packet_count(); packet += 5)
    for (const TrueReturn& r : scanner.fire(packet).returns) {
      const std::string& name = made.world.surfaces()[r.surface];
      bars += name == "fence right";
      link += name == "fence left";
      wires += name == "wires" || name == "stays" || name == "stakes";
      behind += name == "pavement";
      if (name == "fence right") {
        // A bar covers 2 of 12 cm along the street; its rails are at two heights.
        const Vec3 foot = made.motion.centre_line().place(-50, 3.7, 0.12), hit{r.east, r.north, r.up};
        const Vec3 along = normalised(made.motion.centre_line().place(0, 3.7, 0.12) - foot);
        const double u = dot(hit - foot, along), v = hit.z - foot.z, in_panel = u - 2.5 * std::floor(u / 2.5);
        const double in_bar = in_panel - 0.12 * std::floor(in_panel / 0.12);
        EXPECT_TRUE(in_bar < 0.021 || in_bar > 0.119 || (v > 0.079 && v < 0.121) || v > 1.049) << u << " " << v;
      }
    }
  EXPECT_GT(bars, 100u);
  EXPECT_GT(link, 100u);
  EXPECT_GT(wires, 20u);
  EXPECT_GT(behind, 1000u) << "points of the pavement between the bars";
}

TEST(Water, MirrorsAsFresnelSaysAndDarkensTheGround) {
  Scenario s = straight_street();
  const Made dry(s);
  s.street.wetness = 0.6;
  ASSERT_EQ(s.validate(), "");
  const Made wet(s);
  const CentreLine& line = wet.motion.centre_line();
  std::size_t puddles = 0, film = 0, strong = 0;
  for (double along = 4; along < 40; along += 0.31)
    for (const double lateral : {-2.6, -1.1, 0.4, 2.2}) {
      const Vec3 eye = line.place(along - 9, 0.3, 2.6), direction = line.place(along, lateral) - eye;
      const Seen seen = wet.look(0, eye, direction, 300, 0), before = dry.look(0, eye, direction, 300, 0);
      if (wet.name_of(seen) != "road") continue;
      EXPECT_EQ(before.transmitted, 1.0f);
      expect_near(before.colour, before.own, 0, "a dry road mirrors nothing");
      expect_near(seen.own, blend(1 - 0.45 * 0.6, before.own, 0, {}), 1e-5f, "wet ground is darker");
      EXPECT_EQ(seen.distance_m, before.distance_m);
      const Vec3 ahead = normalised(direction);
      const double share = reflected(std::acos(-ahead.z), 1.33);
      ASSERT_LE(1 - seen.transmitted, 1.5 * share + 1e-5);
      if (std::abs(1 - seen.transmitted - share) > 1e-4) {
        ++film;
        continue;
      }
      ++puddles;
      const Vec3 place = eye + seen.distance_m * ahead, away{ahead.x, ahead.y, -ahead.z};
      const Seen image = dry.look(0, place, away, 300, 0);
      expect_near(seen.colour, blend(1 - share, seen.own, share, image.colour), 0.01f, dry.name_of(image));
      strong += share * image.colour.g > 2 * seen.own.g;
    }
  EXPECT_GT(puddles, 60u);
  EXPECT_GT(film, 60u);
  EXPECT_GT(strong, 20u) << "places where a camera sees the mirror rather than the road";
}

TEST(Water, TheTrueColourOfAReturnHasNoMirrorInIt) {
  Scenario s = straight_street();
  s.laser.detection_range_m = 1000;
  const Made dry(s);
  s.street.wetness = 0.5;
  const Made wet(s);
  const Scanner on_dry(dry.scenario, dry.motion, dry.world), on_wet(wet.scenario, wet.motion, wet.world);
  std::size_t compared = 0, weaker = 0;
  for (std::size_t packet = 100; packet < 2000; packet += 37) {
    const FiredPacket a = on_dry.fire(packet), b = on_wet.fire(packet);
    ASSERT_EQ(a.returns.size(), b.returns.size());
    for (std::size_t i = 0; i < a.returns.size(); ++i) {
      const TrueReturn &x = a.returns[i], &y = b.returns[i];
      EXPECT_EQ(x.surface, y.surface);
      EXPECT_EQ(x.east, y.east);
      const bool is_ground = dry.world.surfaces()[x.surface] == "road" || dry.world.surfaces()[x.surface] == "pavement";
      const float factor = is_ground ? 1 - 0.45f * 0.5f : 1.0f;
      if (!is_ground && dry.world.surfaces()[x.surface] == "kerb") continue;
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(y.light[k], factor * x.light[k], 1e-5f);
      compared += is_ground;
    }
    for (std::size_t i = 0; i < a.packet.reflectivity.size(); ++i)
      weaker += b.packet.reflectivity[i] < a.packet.reflectivity[i];
  }
  EXPECT_GT(compared, 2000u);
  EXPECT_GT(weaker, compared / 2);
}

}  // namespace
}  // namespace hueline::sim
