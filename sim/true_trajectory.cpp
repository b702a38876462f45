#include "sim/true_trajectory.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include "sim/byte_file.hpp"
#include "sim/ins_model.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {
namespace {
constexpr GpsNs kSecond = 1'000'000'000, kWeek = 604'800 * kSecond, kStep_ns = kSecond / 200;
constexpr double kWander =
    0.02;  // rad; POSPac's is the longitude that was crossed since the start, times the sine of the latitude
}  // namespace

Status write_true_trajectory(const Scenario& scenario, const Drive& drive, const std::string& path) {
  const Motion motion(scenario);
  const GeodeticPlace origin = scene_origin(scenario);
  const Vec3 origin_ecef = ecef_from_geodetic(origin);
  const Mat3 R_ecef_scene = R_ecef_enu(origin);
  const GpsNs week = drive.begin_gps_ns / kWeek * kWeek;
  ByteWriter out(path);
  for (GpsNs t = drive.begin_gps_ns - 30 * kSecond; t <= drive.end_gps_ns + 5 * kSecond; t += kStep_ns) {
    const TrueState state = motion.state(t);
    const GeodeticPlace place = geodetic_from_ecef(origin_ecef + R_ecef_scene * state.T_enu_body.p);
    const Mat3 R_local_ecef = transposed(R_ecef_enu(place));
    const auto [roll, pitch, heading] = attitude_of(R_local_ecef * (R_ecef_scene * state.T_enu_body.R));
    const Vec3 v = R_local_ecef * (R_ecef_scene * state.velocity_enu);
    const double north = v.y, west = -v.x;
    const std::array<double, 17> record{static_cast<double>(t - week) * 1e-9,
                                        place.latitude,
                                        place.longitude,
                                        place.height,
                                        north * std::cos(kWander) + west * std::sin(kWander),
                                        west * std::cos(kWander) - north * std::sin(kWander),
                                        v.z,
                                        roll,
                                        pitch,
                                        heading + kWander,
                                        kWander};
    out.bytes(record.data(), sizeof(record));
  }
  return out.close();
}

}  // namespace hueline::sim
