#include "sim/exposure_control.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::sim {
namespace {

constexpr int kColumns = 16, kRows = 12;  // size of the metering grid
constexpr int kSettling = 40;             // images that are metered before the first image is exposed
constexpr double kDarkest = 1e-4;

/// Returns the directions of the metered pixels in the lens frame.
std::vector<Vec3> metered(const TrueLens& lens) {
  std::vector<Vec3> out;
  for (int j = 0; j < kRows; ++j)
    for (int i = 0; i < kColumns; ++i)
      if (const auto ray = lens.ray((i + 0.5) * lens.width / kColumns - 0.5, (j + 0.5) * lens.height / kRows - 0.5))
        out.push_back(*ray);
  return out;
}

std::vector<float> look(const World& world, const Moment& moment, const Pose& T_enu_lens,
                        const std::vector<Vec3>& directions) {
  std::vector<float> light;
  std::array<World::Ray, World::kBatch> rays;
  std::array<Seen, World::kBatch> seen;
  for (std::size_t first = 0; first < directions.size(); first += World::kBatch) {
    const std::size_t n = std::min(World::kBatch, directions.size() - first);
    for (std::size_t i = 0; i < n; ++i) rays[i] = {T_enu_lens.p, T_enu_lens.R * directions[first + i]};
    // The cones are wide, because a metered pixel stands for its part of the image.
    world.look(moment, std::span(rays).first(n), 0.02f, std::span(seen).first(n));
    for (std::size_t i = 0; i < n; ++i)
      light.push_back(0.25f * seen[i].colour.r + 0.5f * seen[i].colour.g + 0.25f * seen[i].colour.b);
  }
  return light;
}

double next_gain(const CameraConfig& c, const std::vector<float>& light, double gain) {
  double mean = 0;
  for (const float x : light) mean += std::min(1.0, c.gain * gain * static_cast<double>(x));
  mean /= static_cast<double>(std::max<std::size_t>(1, light.size()));
  const double wanted = gain * std::pow(c.auto_exposure_target / std::max(kDarkest, mean), c.auto_exposure_rate);
  return std::clamp(wanted, 1 / c.auto_exposure_limit, c.auto_exposure_limit);
}

/// Returns the factor of the shutter that is nearest to what is wanted.
float in_steps(const CameraConfig& c, double wanted) {
  constexpr double kStep_us = 10;
  return static_cast<float>(std::max(1.0, std::round(c.exposure_us * wanted / kStep_us)) * kStep_us / c.exposure_us);
}

}  // namespace

std::vector<std::vector<float>> lens_gains(const Scenario& scenario, const World& world, const Motion& motion,
                                           const RigTruth& rig, std::size_t exposures) {
  const CameraConfig& c = scenario.camera;
  std::vector<std::vector<float>> gains(exposures, std::vector<float>(rig.lenses.size(), 1.0f));
  if (!c.auto_exposure) return gains;
  const Shutter shutter(scenario);
  const bool is_common = c.auto_exposure_sets == CameraConfig::AutoSets::Shutter;
  std::vector<std::vector<Vec3>> directions;
  for (const TrueLens& lens : rig.lenses) directions.push_back(metered(lens));
  const auto light_of = [&](std::size_t lens, GpsNs t) {
    return look(world, world.moment(t), motion.T_enu_body(t) * rig.T_body_head * rig.lenses[lens].T_head_lens,
                directions[lens]);
  };
  for (std::size_t index = 0; index < (is_common ? 1 : rig.lenses.size()); ++index) {
    double gain = 1;
    for (std::size_t number = 0; number < exposures; ++number) {
      const GpsNs t = shutter.mid(number, gains[number]);
      auto light = light_of(index, t);
      for (std::size_t other = 1; is_common && other < rig.lenses.size(); ++other)
        for (const float x : light_of(other, t)) light.push_back(x);
      if (number == 0)
        for (int i = 0; i < kSettling; ++i) gain = next_gain(c, light, gain);
      const float chosen = shutter.sets_shutter() ? in_steps(c, gain) : static_cast<float>(gain);
      for (std::size_t lens = 0; lens < rig.lenses.size(); ++lens)
        if (is_common || lens == index) gains[number][lens] = chosen;
      gain = next_gain(c, light, gain);
    }
  }
  return gains;
}

}  // namespace hueline::sim
