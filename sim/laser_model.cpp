#include "sim/laser_model.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"
#include "sim/tone.hpp"

namespace hueline::sim {
namespace {

constexpr double kWireUnit = 0.002;    // unit of distances on Velodyne's wire, m
constexpr float kBeamSpread = 0.003f;  // full width of the beam, rad

/// Returns the share of the pulse that panes let pass, there and back.
float both_ways(const Seen& seen) { return seen.transmitted * seen.transmitted; }

std::uint8_t reflectivity_of(const Seen& seen) {
  // Matt targets have the values 0 .. 100, retroreflectors the values above.
  if (seen.material == Material::SignFace) return 220;
  return static_cast<std::uint8_t>(std::clamp(100.0f * seen.reflectance * both_ways(seen), 1.0f, 100.0f));
}

}  // namespace

Pose between(const Pose& a, const Pose& b, double share) {
  Pose out;
  for (std::size_t i = 0; i < 9; ++i) out.R.m[i] = a.R.m[i] + share * (b.R.m[i] - a.R.m[i]);
  out.p = a.p + share * (b.p - a.p);
  return out;
}

bool is_detected(const LaserConfig& config, const World::Ray& ray, const Seen& seen) {
  if (config.detection_range_m == 0 || seen.material == Material::SignFace) return true;
  const double cosine = std::abs(dot(seen.normal, ray.direction)), range = seen.distance_m / config.detection_range_m;
  return seen.reflectance * both_ways(seen) * cosine >= 0.1 * range * range;
}

ReturnTruth::ReturnTruth(const Scenario& scenario, const World& world)
    : world_(world), tone_(scenario.camera.tone_curve, scenario.camera.gain), unshaded_(ToneCurve::Srgb, 1) {}

TrueReturn ReturnTruth::of(const World::Ray& ray, const Seen& seen, double wire_range_m) const {
  TrueReturn truth;
  truth.surface = seen.surface;
  const Vec3 hit = ray.origin + seen.distance_m * ray.direction;
  const Vec3 beam = ray.origin + wire_range_m * ray.direction;
  truth.east = hit.x, truth.north = hit.y, truth.up = hit.z;
  truth.beam_east = beam.x, truth.beam_north = beam.y, truth.beam_up = beam.z;
  const auto colour = tone_.perfect(seen.own);
  truth.red = colour[0], truth.green = colour[1], truth.blue = colour[2];
  truth.albedo = unshaded_.perfect({seen.albedo.r, seen.albedo.g, seen.albedo.b});
  truth.light = {seen.own.r, seen.own.g, seen.own.b};
  truth.is_moving = world_.is_moving(seen.surface);
  return truth;
}

Scanner::Scanner(const Scenario& scenario, const Motion& motion, const World& world)
    : scenario_(scenario),
      motion_(motion),
      world_(world),
      rig_(rig_truth(scenario)),
      timing_(laser_timing(scenario.laser.model, scenario.laser.vertical_offsets)),
      truth_(scenario, world),
      packets_(static_cast<std::size_t>((scenario.sensors_end_gps_ns() - scenario.sensors_begin_gps_ns()) /
                                        timing_.packet_period_ns())) {}

double Scanner::azimuth_centideg(GpsNs t) const {
  const GpsNs since = t - scenario_.sensors_begin_gps_ns();
  if (scenario_.laser.rate_rpm == 0) {
    // Whole blocks are counted in integers, so that their azimuths are exact.
    const GpsNs block = since / timing_.block_period_ns(), rest = since % timing_.block_period_ns();
    return static_cast<double>(block * timing_.block_step_centideg % 36000) +
           timing_.block_step_centideg * (static_cast<double>(rest) / static_cast<double>(timing_.block_period_ns()));
  }
  const double turns = scenario_.laser.rate_rpm / 60.0 * static_cast<double>(since) * 1e-9;
  return 36000.0 * (turns - std::floor(turns));
}

FiredPacket Scanner::fire(std::size_t index) const {
  const LaserConfig& config = scenario_.laser;
  const GpsNs start = scenario_.sensors_begin_gps_ns() + static_cast<GpsNs>(index) * timing_.packet_period_ns();
  const std::size_t lasers = timing_.beams.size();
  FiredPacket out;
  out.packet.first_firing_gps_ns = start;
  out.packet.distance_2mm.assign(12 * 32, 0);
  out.packet.reflectivity.assign(12 * 32, 0);
  const Moment base = world_.moment(start);
  out.scanner_enu = base.T_enu_body * rig_.T_body_scanner.p;

  for (std::size_t block = 0; block < 12; ++block) {
    const GpsNs block_start = start + static_cast<GpsNs>(block) * timing_.block_period_ns();
    double reported = azimuth_centideg(block_start);
    if (scenario_.noise)
      reported += 100 * config.motor_jitter_deg * gaussian(scenario_.seed, kStreamMotor, index * 12 + block);
    out.packet.azimuth_centideg[block] = static_cast<std::uint16_t>((std::llround(reported) + 36000) % 36000);

    for (int sequence = 0; sequence < timing_.firings_per_block; ++sequence) {
      const GpsNs sequence_start = block_start + sequence * timing_.firing_period_ns;
      const Pose T_from = motion_.T_enu_body(sequence_start) * rig_.T_body_scanner;
      const Pose T_to = motion_.T_enu_body(sequence_start + timing_.firing_period_ns) * rig_.T_body_scanner;
      const Moment moment = world_.moment(base, sequence_start, motion_.T_enu_body(sequence_start));
      for (std::size_t first = 0; first < lasers; first += World::kBatch) {
        std::array<World::Ray, World::kBatch> rays;
        std::array<Seen, World::kBatch> seen;
        for (std::size_t i = 0; i < World::kBatch; ++i) {
          const LaserBeam& beam = timing_.beams[first + i];
          const auto after = static_cast<GpsNs>(first + i) * timing_.laser_period_ns;
          const Pose T =
              between(T_from, T_to, static_cast<double>(after) / static_cast<double>(timing_.firing_period_ns));
          const double az = radians(azimuth_centideg(sequence_start + after) / 100.0), el = beam.elevation;
          rays[i].origin = T * Vec3{0, 0, beam.vertical_offset_m};
          rays[i].direction =
              normalised(T.R * Vec3{std::cos(el) * std::sin(az), std::cos(el) * std::cos(az), std::sin(el)});
          rays[i].near_m = 0.05;
          rays[i].far_m = config.max_range_m;
        }
        world_.look(moment, rays, kBeamSpread, seen);
        for (std::size_t i = 0; i < World::kBatch; ++i) {
          if (!seen[i].is_hit || !is_detected(config, rays[i], seen[i])) continue;
          const std::size_t slot = block * 32 + static_cast<std::size_t>(sequence) * lasers + first + i;
          const std::uint64_t counter = index * 384 + slot;
          double range = seen[i].distance_m;
          if (scenario_.noise) {
            if (uniform(scenario_.seed, kStreamDropout, counter) < config.dropout_probability) continue;
            range += config.range_sigma_m * gaussian(scenario_.seed, kStreamRange, counter);
          }
          if (range < config.min_range_m || range > config.max_range_m) continue;
          const auto wire = static_cast<std::uint16_t>(std::llround(range / kWireUnit));
          out.packet.distance_2mm[slot] = wire;
          out.packet.reflectivity[slot] = reflectivity_of(seen[i]);
          TrueReturn truth = truth_.of(rays[i], seen[i], wire * kWireUnit);
          truth.fired_gps_ns = sequence_start + static_cast<GpsNs>(first + i) * timing_.laser_period_ns;
          truth.channel = timing_.beams[first + i].channel;
          out.returns.push_back(truth);
        }
      }
    }
  }
  return out;
}

}  // namespace hueline::sim
