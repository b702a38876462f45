#include "sim/ins_model.hpp"

#include <algorithm>
#include <cmath>

#include "sim/ins_outage.hpp"
#include "sim/noise.hpp"

namespace hueline::sim {

GeodeticPlace scene_origin(const Scenario& c) {
  return {radians(c.origin_latitude_deg), radians(c.origin_longitude_deg), c.origin_height_m};
}

std::vector<InsSample> simulate_ins(const Scenario& c, const Motion& motion) {
  const GeodeticPlace origin = scene_origin(c);
  const Vec3 origin_ecef = ecef_from_geodetic(origin);
  const Mat3 R_ecef_scene = R_ecef_enu(origin);

  const InsConfig ins = graded(c.ins);
  OutageDrift drift(ins, c.seed);
  const auto has_gnss = [&](GpsNs t) {
    const double at = static_cast<double>(t - c.sensors_begin_gps_ns()) * 1e-9;
    return std::none_of(ins.outages.begin(), ins.outages.end(),
                        [&](const InsOutage& o) { return at >= o.at_s && at < o.at_s + o.for_s; });
  };
  // Position E N U, velocity E N U, roll, pitch, heading.
  const double rp = radians(ins.roll_pitch_sigma_deg), hd = radians(ins.heading_sigma_deg);
  const double pos = ins.position_sigma_m, vel = ins.velocity_sigma;
  const std::array<double, 9> slow{pos, pos, 1.5 * pos, vel, vel, vel, rp, rp, hd};
  const double pw = ins.position_white_m, aw = radians(ins.attitude_white_deg);
  const std::array<double, 9> white{pw, pw, pw, 0, 0, 0, aw, aw, aw};
  const double step_s = 1.0 / ins.rate_hz;
  const double keep = std::exp(-step_s / ins.correlation_s), renew = std::sqrt(1 - keep * keep);

  std::array<double, 9> error{};
  if (c.noise)
    for (std::size_t i = 0; i < 9; ++i) error[i] = slow[i] * gaussian(c.seed, kStreamIns + i, 0);

  std::vector<InsSample> samples;
  const GpsNs period = 1'000'000'000 / ins.rate_hz;
  std::uint64_t index = 0;
  for (GpsNs t = c.begin_gps_ns(); t <= c.end_gps_ns(); t += period) {
    ++index;
    std::array<double, 9> e{};
    if (c.noise)
      for (std::size_t i = 0; i < 9; ++i) {
        error[i] = keep * error[i] + renew * slow[i] * gaussian(c.seed, kStreamIns + i, index);
        e[i] = error[i] + white[i] * gaussian(c.seed, kStreamIns + 9 + i, index);
      }
    const TrueState state = motion.state(t);
    const bool sees_satellites = has_gnss(t);
    if (!ins.outages.empty()) {
      drift.advance(step_s, sees_satellites, state.heading, std::hypot(state.velocity_enu.x, state.velocity_enu.y),
                    index);
      for (std::size_t i = 0; i < 9 && c.noise; ++i) e[i] += drift.error()[i];
    }
    const Vec3 p_ecef = R_ecef_scene * (state.T_enu_body.p + Vec3{e[0], e[1], e[2]}) + origin_ecef;
    const GeodeticPlace g = geodetic_from_ecef(p_ecef);
    const Mat3 R_here_scene = transposed(R_ecef_enu(g)) * R_ecef_scene;
    const auto attitude = attitude_of(R_here_scene * state.T_enu_body.R);
    const Vec3 v = R_here_scene * state.velocity_enu;
    InsSample s;
    s.gps_ns = t;
    s.latitude_rad = g.latitude;
    s.longitude_rad = g.longitude;
    s.ellipsoidal_height_m = g.height;
    s.velocity_east = v.x + e[3];
    s.velocity_north = v.y + e[4];
    s.velocity_up = v.z + e[5];
    s.roll_rad = attitude[0] + e[6];
    s.pitch_rad = attitude[1] + e[7];
    const double heading = attitude[2] + e[8];
    s.heading_rad = heading - 2 * kPi * std::floor(heading / (2 * kPi));
    const auto drifted = drift.sigma();
    for (std::size_t i = 0; i < 9; ++i) s.sigma[i] = std::hypot(std::hypot(slow[i], white[i]), drifted[i]);
    s.has_gnss = sees_satellites;
    // The receiver judges by the sigma that it claims: after a long outage it stays large for a while although
    // satellites are back.
    s.status = drifted[0] > ins.high_variance_m ? 2 : (sees_satellites ? 3 : 6);
    samples.push_back(s);
  }
  return samples;
}

}  // namespace hueline::sim
