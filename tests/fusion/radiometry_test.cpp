#include "fusion/radiometry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace hueline::fusion {
namespace {

constexpr std::size_t kLenses = 5;
constexpr double kFalloffA = 0.14, kFalloffB = 0.04;
constexpr double kInterval = 0.5;

/// Random numbers. Those of <random> take logarithms in extended precision for each, a third of what these tests took.
class Chance {
 public:
  explicit Chance(std::mt19937& source) : source_(source) {}
  /// Returns a number from 0 to 1.
  double share() {
    const auto low = static_cast<double>(source_()), high = static_cast<double>(source_());
    return (low + high * 0x1p32) * 0x1p-64;
  }
  /// Returns a number of the standard normal distribution, by the polar method: two at a time.
  double normal() {
    if (std::exchange(has_spare_, false)) return spare_;
    double x = 0, y = 0, square = 0;
    do {
      x = 2 * share() - 1;
      y = 2 * share() - 1;
      square = x * x + y * y;
    } while (square > 1 || square == 0);
    const double scale = std::sqrt(-2 * std::log(square) / square);
    spare_ = x * scale;
    has_spare_ = true;
    return y * scale;
  }

 private:
  std::mt19937& source_;
  double spare_ = 0;
  bool has_spare_ = false;
};

GpsTime exposed_at(double seconds) { return GpsTime(from_seconds(seconds)); }

/// A row of places that a vehicle passes. At each moment it sees those around it: ahead through lens 0, beside it
/// through lenses 1 and 2 alternately, behind it through lenses 3 and 4. Neighbouring lenses overlap.
struct World {
  std::function<double(int moment, std::size_t lens)> log_gain = [](int, std::size_t) { return 0.0; };
  std::function<double(std::size_t lens, std::size_t channel)> log_balance = [](std::size_t, std::size_t) {
    return 0.0;
  };
  /// Factor on the light of a place at a moment: 1 in the sun.
  std::function<double(int place, int moment)> shade = [](int, int) { return 1.0; };
  double noise = 0.03;
  bool saturates = true;
  /// What the camera says of a lens's exposure.
  std::function<ReportedExposure(int moment, std::size_t lens)> reported;
  static constexpr int kPlacesEach = 300, kReach = 3;  // places for each moment; moments from which a place is seen

  double light(int place, std::size_t channel) const {
    std::minstd_rand random(static_cast<unsigned>(place * 3) + static_cast<unsigned>(channel) + 1);
    random.discard(3);
    return std::exp(std::uniform_real_distribution<double>(std::log(0.05), std::log(0.6))(random));
  }
  std::vector<ReportedExposure> reports(int moment) const {
    std::vector<ReportedExposure> out;
    for (std::size_t l = 0; reported && l < kLenses; ++l) out.push_back(reported(moment, l));
    return out;
  }
  std::vector<Radiometry::Place> places(int moment, std::mt19937& random) const {
    Chance chance(random);
    std::vector<Radiometry::Place> out;
    for (int p = (moment - kReach) * kPlacesEach; p < (moment + kReach) * kPlacesEach; ++p) {
      Radiometry::Place place;
      const std::array<double, 3> own_light{light(p, 0), light(p, 1), light(p, 2)};
      for (int m = moment; m >= std::max(0, moment - 4); --m) {
        const double ahead = static_cast<double>(p) / kPlacesEach - m;
        if (std::abs(ahead) > kReach) continue;
        const std::size_t side = p % 2 == 0 ? 0 : 1;
        std::vector<std::size_t> lenses;
        if (ahead > 0.4) lenses.push_back(0);
        if (std::abs(ahead) < 0.8) lenses.push_back(1 + side);
        if (ahead < -0.4) lenses.push_back(3 + side);
        for (const std::size_t lens : lenses) {
          Radiometry::Glimpse g;
          g.moment = static_cast<std::uint64_t>(m);
          g.lens = static_cast<std::uint8_t>(lens);
          const double q = chance.share();
          g.off_axis = static_cast<float>(q);
          for (std::size_t c = 0; c < 3; ++c) {
            const double delivered = own_light[c] * shade(p, m) *
                                     std::exp(log_gain(m, lens) + log_balance(lens, c) - kFalloffA * q -
                                              kFalloffB * q * q + noise * chance.normal());
            // A lens does not tell how bright it is where it saturates, nor where there is only noise.
            const bool is_usable = !saturates || (delivered < 0.85 && delivered > 0.01);
            g.light[c] = is_usable ? static_cast<float>(delivered) : 0.0f;
          }
          place.push_back(g);
        }
      }
      out.push_back(place);
    }
    return out;
  }
};

struct Outcome {
  std::map<std::uint64_t, HeadGains> gains;
  Radiometry radiometry;
};

/// Adds moment after moment and settles each four moments later, as the colouring does.
Outcome drive(const World& world, int moments, const Radiometry::Config& config = {}) {
  Outcome out{{}, Radiometry(config, kLenses)};
  std::mt19937 random(7);
  for (int m = 0; m < moments; ++m) {
    out.radiometry.add(static_cast<std::uint64_t>(m), exposed_at(m * kInterval), world.places(m, random),
                       world.reports(m));
    if (m < 5) continue;
    for (auto& [moment, gains] : out.radiometry.settle(exposed_at((m - 4) * kInterval)))
      out.gains[moment] = std::move(gains);
  }
  for (auto& [moment, gains] : out.radiometry.settle(exposed_at(1e6))) out.gains[moment] = std::move(gains);
  return out;
}

/// Returns the largest error of a moment's gains, as a logarithm. The reference is lens 0 at moment 0.
double worst_error(const World& world, const Outcome& out, int moment) {
  double worst = 0;
  for (std::size_t l = 0; l < kLenses; ++l)
    for (std::size_t c = 0; c < 3; ++c) {
      const double truth =
          world.log_gain(moment, l) + world.log_balance(l, c) - world.log_gain(0, 0) - world.log_balance(0, c);
      const double found = -std::log(out.gains.at(static_cast<std::uint64_t>(moment)).lenses[l].scale[c]);
      worst = std::max(worst, std::abs(found - truth));
    }
  return worst;
}

double worst_error(const World& world, const Outcome& out, int first, int last) {
  double worst = 0;
  for (int m = first; m < last; ++m) worst = std::max(worst, worst_error(world, out, m));
  return worst;
}

/// From daylight through a tunnel that is twelve times as dark, and out again. Each lens adapts at its own pace.
double tunnel_gain(int moment, std::size_t lens) {
  const double in = 1 / (1 + std::exp(-(moment - 20 - 0.4 * static_cast<double>(lens)) * 1.2)),
               out = 1 / (1 + std::exp(-(moment - 40 - 0.4 * static_cast<double>(lens)) * 1.2));
  return std::log(12.0) * (in - out) + 0.1 * static_cast<double>(lens);
}
double tunnel_shade(int place) {
  const double x = static_cast<double>(place) / World::kPlacesEach;
  return x > 20 && x < 40 ? 1 / 12.0 : 1.0;
}

TEST(Radiometry, FindsGainsBalanceAndVignetting) {
  World world;
  world.log_gain = [](int m, std::size_t l) { return 0.4 * std::sin(0.7 * m + static_cast<double>(l)); };
  world.log_balance = [](std::size_t l, std::size_t c) {
    return c == 0 ? 0.04 * static_cast<double>(l) : (c == 2 ? -0.03 * static_cast<double>(l) : 0.0);
  };
  const Outcome out = drive(world, 40);
  ASSERT_EQ(out.gains.size(), 40u);
  EXPECT_LT(worst_error(world, out, 0, 40), 0.02);
  for (const auto& [a, b] : out.gains.at(39).falloff) {
    EXPECT_NEAR(a + b, kFalloffA + kFalloffB, 0.01);  // at the corner
    EXPECT_NEAR(0.5 * a + 0.25 * b, 0.5 * kFalloffA + 0.25 * kFalloffB, 0.01);
  }
}

TEST(Radiometry, ThingsThatMoveAndShadowsThatMoveDoNotDisturb) {
  World world;
  world.log_gain = [](int m, std::size_t l) { return 0.3 * std::sin(0.5 * m + static_cast<double>(l)); };
  // A quarter of the places is seen in another light, or is another thing, at every third moment.
  world.shade = [](int p, int m) { return p % 4 == 0 && (p / 4 + m) % 3 == 0 ? 0.3 : 1.0; };
  EXPECT_LT(worst_error(world, drive(world, 40), 0, 40), 0.03);
}

TEST(Radiometry, WhatIsInShadowStaysInShadow) {
  World world;
  world.shade = [](int p, int) { return (p / 200) % 2 == 0 ? 0.2 : 1.0; };
  EXPECT_LT(worst_error(world, drive(world, 40), 0, 40), 0.02);
}

TEST(Radiometry, TunnelEndsWhereItBegan) {
  World world;
  world.log_gain = tunnel_gain;
  world.shade = [](int p, int) { return tunnel_shade(p); };
  const Outcome out = drive(world, 70);
  EXPECT_LT(worst_error(world, out, 0, 70), 0.05);
  EXPECT_LT(worst_error(world, out, 60, 70), 0.02);
}

TEST(Radiometry, DoesNotDriftInAThousandExposuresOfOneGain) {
  const World world;
  EXPECT_LT(worst_error(world, drive(world, 1000), 900, 1000), 0.01);
}

TEST(Radiometry, DriftsLittleInAThousandExposuresOfChangingGain) {
  World world;
  world.log_gain = [](int m, std::size_t l) { return 0.6 * std::sin(0.21 * m + static_cast<double>(l)); };
  const double worst = worst_error(world, drive(world, 1000), 900, 1000);
  std::printf("after 1000 exposures: %.4f\n", worst);
  EXPECT_LT(worst, 0.05);
}

/// Reports a gain with the precision of a camera: the exposure in steps of 10 us, the amplifier in steps of 0.1 dB.
ReportedExposure told_by_camera(double log_gain) {
  const double us = 2000 * std::exp(log_gain * 0.7), dB = 20 * std::log10(std::exp(log_gain * 0.3));
  return {.duration = nanoseconds(10'000 * std::llround(us / 10)),
          .gain = static_cast<float>(std::pow(10, std::round(dB * 10) / 10 / 20))};
}

TEST(Radiometry, DoesNotDriftInAThousandExposuresOfReportedGain) {
  World world;
  world.log_gain = [](int m, std::size_t l) { return 0.6 * std::sin(0.21 * m + static_cast<double>(l)); };
  world.reported = [&](int m, std::size_t l) { return told_by_camera(world.log_gain(m, l)); };
  const double worst = worst_error(world, drive(world, 1000), 900, 1000);
  std::printf("after 1000 exposures: %.4f\n", worst);
  EXPECT_LT(worst, 0.015);
}

TEST(Radiometry, ReportedGainsTellOfLensesThatSeeNothingCommon) {
  World world;
  world.saturates = false;
  world.log_gain = [](int m, std::size_t l) { return 0.8 * std::sin(0.3 * m + static_cast<double>(l)); };
  std::mt19937 random(7);
  Radiometry radiometry({}, kLenses);
  const auto told = [&](int m) {
    std::vector<ReportedExposure> out;
    for (std::size_t l = 0; l < kLenses; ++l) out.push_back(told_by_camera(world.log_gain(m, l)));
    return out;
  };
  for (int m = 0; m < 20; ++m) {
    radiometry.add(static_cast<std::uint64_t>(m), exposed_at(m * kInterval), {}, told(m));
    for (const auto& [moment, found] : radiometry.settle(exposed_at(m * kInterval)))
      for (std::size_t l = 0; l < kLenses; ++l)
        for (const float scale : found.lenses[l].scale)
          EXPECT_NEAR(-std::log(scale), world.log_gain(m, l) - world.log_gain(0, 0), 0.02) << moment << " " << l;
  }
}

TEST(Radiometry, ReportsThatAreWrongDoNoHarm) {
  World world;
  world.log_gain = tunnel_gain;
  world.shade = [](int p, int) { return tunnel_shade(p); };
  const double without = worst_error(world, drive(world, 70), 0, 70);
  // A register whose unit is not what the rig says; one that stands still; one that is noise.
  const std::vector<std::function<ReportedExposure(int, std::size_t)>> wrong{
      [&](int m, std::size_t l) { return told_by_camera(0.5 * world.log_gain(m, l)); },
      [&](int, std::size_t) { return told_by_camera(0); },
      [&](int m, std::size_t l) { return told_by_camera(0.3 * std::sin(37.0 * m + 11.0 * static_cast<double>(l))); }};
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    world.reported = wrong[i];
    const Outcome out = drive(world, 70);
    std::printf("wrong report %zu: %.4f (%.4f without)\n", i, worst_error(world, out, 0, 70), without);
    EXPECT_LT(worst_error(world, out, 0, 70), 0.08) << i;
    EXPECT_LT(worst_error(world, out, 60, 70), 0.04) << i;
  }
}

TEST(Radiometry, ALensThatSeesNothingCommonChangesAsTheOthers) {
  for (const double amplitude : {0.0, 0.8}) {
    World world;
    world.saturates = false;
    world.log_gain = [amplitude](int m, std::size_t) { return amplitude * std::sin(0.3 * m); };
    std::mt19937 random(7);
    Radiometry radiometry({}, kLenses);
    for (int m = 0; m < 20; ++m) {
      auto places = world.places(m, random);
      for (Radiometry::Place& place : places)
        for (Radiometry::Glimpse& g : place)
          if (g.lens == 4) g.light = {};
      radiometry.add(static_cast<std::uint64_t>(m), exposed_at(m * kInterval), places);
      for (const auto& [moment, found] : radiometry.settle(exposed_at(m * kInterval)))
        for (const float scale : found.lenses[4].scale)
          EXPECT_NEAR(-std::log(scale), world.log_gain(m, 4), 0.03 + 0.1 * amplitude) << moment;
    }
  }
}

TEST(Radiometry, SettledGainsStayWhatTheyAre) {
  World world;
  world.log_gain = [](int m, std::size_t) { return 0.1 * (m % 3); };
  std::mt19937 random(7);
  Radiometry radiometry({}, kLenses);
  for (int m = 0; m < 20; ++m) {
    radiometry.add(static_cast<std::uint64_t>(m), exposed_at(m * kInterval), world.places(m, random));
    for (const auto& [moment, gains] : radiometry.settle(exposed_at((m - 3) * kInterval)))
      EXPECT_GT(static_cast<int>(moment), m - 5) << "moment " << moment << " was settled, and was told again at " << m;
  }
}

TEST(Radiometry, OnlyUsableValuesAreCompared) {
  EXPECT_FALSE(Radiometry::is_usable(255));
  EXPECT_FALSE(Radiometry::is_usable(250));
  EXPECT_TRUE(Radiometry::is_usable(200));
  EXPECT_TRUE(Radiometry::is_usable(40));
  EXPECT_FALSE(Radiometry::is_usable(5));
}

TEST(Radiometry, RendersLightInTheCurveOfTheCamera) {
  for (const Response response : {Response::Srgb, Response::Linear, Response::Gamma}) {
    Radiometry::Config config;
    config.response = response;
    const Radiometry radiometry(config, 1);
    for (int value = 0; value < 256; ++value) {
      const double x = value / 255.0;
      const double light = response == Response::Linear  ? x
                           : response == Response::Gamma ? std::pow(x, 2.2)
                           : x <= 0.04045                ? x / 12.92
                                                         : std::pow((x + 0.055) / 1.055, 2.4);
      const double coded = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
      const auto v = static_cast<float>(value);
      EXPECT_NEAR(radiometry.render({v, v, v}, nullptr, 0, 0, 1)[0], 255 * coded, 0.56) << value;
    }
  }
}

TEST(Radiometry, RendersTheLightThatAPixelWithoutGainAndVignettingWouldHave) {
  const Radiometry radiometry({}, 1);
  HeadGains gains;
  gains.lenses.resize(1);
  gains.lenses[0].scale = {0.5f, 1.0f, 2.0f};
  gains.falloff.fill({0.1f, 0.2f});
  const auto srgb = [](double x) { return 255 * (1.055 * std::pow(x, 1 / 2.4) - 0.055); };
  const double lifted = std::exp(0.1 * 0.8 + 0.2 * 0.64);
  const auto coded = static_cast<float>(srgb(0.2));
  const auto colour = radiometry.render({coded, coded, coded}, &gains, 0, 0.8f, 1);
  EXPECT_NEAR(colour[0], srgb(0.2 * 0.5 * lifted), 0.6);
  EXPECT_NEAR(colour[1], srgb(0.2 * 1.0 * lifted), 0.6);
  EXPECT_NEAR(colour[2], srgb(0.2 * 2.0 * lifted), 0.6);
}

TEST(Radiometry, EvenedLiftsATunnelSlowly) {
  World world;
  world.log_gain = tunnel_gain;
  world.shade = [](int p, int) { return tunnel_shade(p); };
  Radiometry::Config config;
  EXPECT_EQ(drive(world, 70, config).radiometry.adaptation(exposed_at(15)), 1);
  config.rendering = Rendering::Evened;
  const Outcome out = drive(world, 70, config);
  const float outside = out.radiometry.adaptation(exposed_at(33)), inside = out.radiometry.adaptation(exposed_at(15));
  EXPECT_NEAR(inside / outside, std::pow(12, 0.75), 1.2);
  for (double t = 7; t < 34; t += 0.1)
    EXPECT_LT(
        std::abs(std::log(out.radiometry.adaptation(exposed_at(t + 0.1)) / out.radiometry.adaptation(exposed_at(t)))),
        0.15)
        << t;
  // However bright it becomes, a lighter surface remains lighter, and nothing saturates that did not.
  int before = -1;
  for (int value = 0; value < 256; value += 5) {
    const auto v = static_cast<float>(value);
    const int now = out.radiometry.render({v, v, v}, nullptr, 0, 0, inside)[0];
    EXPECT_GE(now, before);
    EXPECT_LT(now, 255);
    before = now;
  }
}

TEST(Radiometry, ManyPixelsAtOnceHaveTheColoursOfEach) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(-2, 257), share(0, 1);
  for (const Rendering rendering : {Rendering::AsDelivered, Rendering::Consistent, Rendering::Evened}) {
    Radiometry::Config config;
    config.rendering = rendering;
    const Radiometry radiometry(config, kLenses);
    HeadGains gains;
    for (std::size_t lens = 0; lens < kLenses; ++lens) {
      HeadGains::OfLens of_lens;
      for (float& scale : of_lens.scale) scale = 0.4f + 1.2f * share(random);
      gains.lenses.push_back(of_lens);
    }
    gains.falloff = {{{0.2f, 0.05f}, {0.21f, 0.04f}, {0.25f, 0.03f}}};
    for (const std::size_t count : {0ul, 5ul, 16ul, 1003ul}) {
      std::vector<Rgb> pixels(count);
      std::vector<std::uint8_t> lens(count);
      std::vector<float> off_axis(count);
      for (std::size_t i = 0; i < count; ++i) {
        pixels[i].red = value(random);
        pixels[i].green = value(random);
        pixels[i].blue = value(random);
        lens[i] = static_cast<std::uint8_t>(i % kLenses);
        off_axis[i] = share(random);
      }
      for (const HeadGains* given : {static_cast<const HeadGains*>(nullptr), static_cast<const HeadGains*>(&gains)}) {
        std::vector<std::array<std::uint8_t, 3>> colours(count);
        radiometry.render_each(pixels, given, lens.data(), off_axis.data(), 1.7f, colours.data());
        for (std::size_t i = 0; i < count; ++i)
          ASSERT_EQ(colours[i], radiometry.render(pixels[i], given, lens[i], off_axis[i], 1.7f));
      }
    }
  }
}

}  // namespace
}  // namespace hueline::fusion
