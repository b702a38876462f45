#pragma once

#include <cstdint>

#include "sim/drive.hpp"

namespace hueline::sim::test {

/// 2024-03-05 12:59:58.25 UTC. The next UTC hour begins 1.75 s after the drive began.
constexpr GpsNs kBegin = (1'393'678'798LL + 18) * 1'000'000'000LL + 250'000'000LL;

/// Returns a drive without a world: `seconds` of POS solutions at 100 Hz, VLP-16 packets without gaps, and an exposure
/// each half second.
inline Drive short_drive(int seconds) {
  Drive drive;
  drive.begin_gps_ns = kBegin;
  drive.end_gps_ns = kBegin + seconds * 1'000'000'000LL;
  for (GpsNs t = kBegin; t < drive.end_gps_ns; t += 10'000'000) {
    InsSample s;
    s.gps_ns = t;
    s.latitude_rad = 0.9;
    s.longitude_rad = 0.2;
    s.velocity_north = 10;
    s.heading_rad = 6.2;
    drive.ins.push_back(s);
  }
  std::uint16_t azimuth = 35900;
  for (GpsNs t = kBegin; t + 1'327'104 < drive.end_gps_ns; t += 1'327'104) {
    LaserPacket packet;
    packet.first_firing_gps_ns = t;
    for (auto& a : packet.azimuth_centideg) {
      a = azimuth;
      azimuth = static_cast<std::uint16_t>((azimuth + 40) % 36000);
    }
    packet.distance_2mm.assign(384, static_cast<std::uint16_t>(drive.laser.size()));
    packet.reflectivity.assign(384, 100);
    drive.laser.push_back(packet);
  }
  for (GpsNs t = kBegin + 100'000'000; t < drive.end_gps_ns; t += 500'000'000) {
    CameraExposure exposure;
    exposure.number = static_cast<std::uint32_t>(drive.exposures.size());
    exposure.exposure_start_gps_ns = t;
    exposure.exposure_ns = 2'000'000;
    exposure.width = 64;
    exposure.height = 48;
    drive.exposures.push_back(exposure);
  }
  for (int i = 0; i <= seconds; ++i) drive.pps_edge_error_ns.push_back(i % 2 == 0 ? 40 : -70);
  return drive;
}

}  // namespace hueline::sim::test
