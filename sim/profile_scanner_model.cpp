#include "sim/profile_scanner_model.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace hueline::sim {
namespace {

/// Pulses that fit into one Ethernet frame of 1500 bytes if every pulse has a return: 44 + 204 x 7 = 1472.
constexpr std::int64_t kPulses = 204;
constexpr double kProfileUnit = 1e-4;  // m
constexpr double kTurnUnits = 4294967296.0;
constexpr float kProfileSpread = 0.0005f;  // full width of the beam, rad

std::uint16_t reflectance_of(const Seen& seen) {
  if (seen.material == Material::SignFace) return 50'000;  // retroreflective: five times as bright as white
  return static_cast<std::uint16_t>(
      std::lround(10'000 * std::clamp(seen.reflectance * seen.transmitted * seen.transmitted, 0.01f, 1.0f)));
}

}  // namespace

ProfileScanner::ProfileScanner(const Scenario& scenario, const Motion& motion, const World& world)
    : scenario_(scenario),
      motion_(motion),
      world_(world),
      rig_(rig_truth(scenario)),
      timing_(profile_timing(scenario.laser)),
      truth_(scenario, world) {
  if (scenario.laser.model != LaserModel::Profile) return;
  const std::int64_t lasts_ns = scenario.sensors_end_gps_ns() - scenario.sensors_begin_gps_ns();
  packets_ = static_cast<std::size_t>(lasts_ns * 1000 / (kPulses * timing_.pulse_period_ps));
}

FiredProfile ProfileScanner::fire(std::size_t index) const {
  const LaserConfig& config = scenario_.laser;
  const std::int64_t first = static_cast<std::int64_t>(index) * kPulses;
  const GpsNs begin = scenario_.sensors_begin_gps_ns(), start = begin + timing_.pulse_ns(first);
  const std::uint64_t turned = timing_.turned(first);
  FiredProfile out;
  out.packet.first_pulse_gps_ns = start;
  out.packet.line = static_cast<std::uint32_t>(turned >> 32U);
  out.packet.angle = static_cast<std::uint32_t>(turned);
  if (scenario_.noise) {
    const double error = config.motor_jitter_deg / 360 * kTurnUnits * gaussian(scenario_.seed, kStreamMotor, index);
    out.packet.angle += static_cast<std::uint32_t>(std::llround(error));
  }
  out.packet.angle_step = static_cast<std::int32_t>(timing_.angle_step);
  out.packet.period_ps = static_cast<std::uint32_t>(timing_.pulse_period_ps);
  out.packet.counts.assign(kPulses, 0);
  const Moment base = world_.moment(start);
  out.scanner_enu = base.T_enu_body * rig_.T_body_scanner.p;

  for (std::int64_t from = 0; from < kPulses; from += World::kBatch) {
    const auto count = static_cast<std::size_t>(std::min<std::int64_t>(World::kBatch, kPulses - from));
    const GpsNs batch_start = begin + timing_.pulse_ns(first + from),
                batch_end = begin + timing_.pulse_ns(first + from + World::kBatch);
    const Pose T_enu_body = motion_.T_enu_body(batch_start);
    const Pose T_from = T_enu_body * rig_.T_body_scanner, T_to = motion_.T_enu_body(batch_end) * rig_.T_body_scanner;
    const Moment moment = world_.moment(base, batch_start, T_enu_body);
    std::array<World::Ray, World::kBatch> rays;
    std::array<Seen, World::kBatch> seen;
    std::array<GpsNs, World::kBatch> fired{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t pulse = first + from + static_cast<std::int64_t>(i);
      fired[i] = begin + timing_.pulse_ns(pulse);
      const Pose T = between(
          T_from, T_to, static_cast<double>(fired[i] - batch_start) / static_cast<double>(batch_end - batch_start));
      const double angle = static_cast<double>(timing_.turned(pulse) & 0xFFFFFFFFu) / kTurnUnits * 2 * kPi;
      rays[i].origin = T.p;
      rays[i].direction = normalised(T.R * Vec3{std::sin(angle), std::cos(angle), 0});
      rays[i].near_m = 0.05;
      rays[i].far_m = config.max_range_m;
    }
    world_.look(moment, std::span(rays).first(count), kProfileSpread, std::span(seen).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      if (!seen[i].is_hit || !is_detected(config, rays[i], seen[i])) continue;
      const auto counter = static_cast<std::uint64_t>(first + from) + i;
      double range = seen[i].distance_m;
      if (scenario_.noise) {
        if (uniform(scenario_.seed, kStreamDropout, counter) < config.dropout_probability) continue;
        range += config.range_sigma_m * gaussian(scenario_.seed, kStreamRange, counter);
      }
      if (range < config.min_range_m || range > config.max_range_m) continue;
      const auto wire = static_cast<std::uint32_t>(std::llround(range / kProfileUnit));
      out.packet.counts[static_cast<std::size_t>(from) + i] = 1;
      out.packet.range_100um.push_back(wire);
      out.packet.reflectance_1e4.push_back(reflectance_of(seen[i]));
      TrueReturn truth = truth_.of(rays[i], seen[i], wire * kProfileUnit);
      truth.fired_gps_ns = fired[i];
      out.returns.push_back(truth);
    }
  }
  return out;
}

}  // namespace hueline::sim
