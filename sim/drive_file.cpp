#include "sim/drive_file.hpp"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "sim/byte_file.hpp"

namespace hueline::sim {
namespace {
constexpr std::size_t kSlots = 12 * 32;

void read_trajectory(ByteReader& in, std::vector<InsSample>& samples) {
  const auto count = in.number<std::uint64_t>();
  if (in.fits(count, 154)) samples.resize(count);
  for (InsSample& s : samples) {
    s.gps_ns = in.number<GpsNs>();
    for (double* x : {&s.latitude_rad, &s.longitude_rad, &s.ellipsoidal_height_m, &s.velocity_east, &s.velocity_north,
                      &s.velocity_up, &s.roll_rad, &s.pitch_rad, &s.heading_rad})
      *x = in.number<double>();
    for (double& x : s.sigma) x = in.number<double>();
    s.status = in.number<std::uint8_t>();
    s.has_gnss = in.number<std::uint8_t>() != 0;
  }
}

void read_laser(ByteReader& in, std::vector<LaserPacket>& packets) {
  const auto count = in.number<std::uint64_t>();
  if (in.fits(count, 32 + 3 * kSlots)) packets.resize(count);
  for (LaserPacket& p : packets) {
    p.first_firing_gps_ns = in.number<GpsNs>();
    in.bytes(p.azimuth_centideg.data(), 24);
    p.distance_2mm.resize(kSlots);
    p.reflectivity.resize(kSlots);
    in.bytes(p.distance_2mm.data(), 2 * kSlots);
    in.bytes(p.reflectivity.data(), kSlots);
  }
}

void read_exposures(ByteReader& in, std::vector<CameraExposure>& exposures) {
  const auto count = in.number<std::uint64_t>();
  if (in.fits(count, 32)) exposures.resize(count);
  for (CameraExposure& e : exposures) {
    e.number = in.number<std::uint32_t>();
    e.exposure_start_gps_ns = in.number<GpsNs>();
    e.exposure_ns = in.number<std::int64_t>();
    e.width = in.number<std::uint32_t>();
    e.height = in.number<std::uint32_t>();
    e.image_file = in.text();
  }
}

void read_reports(ByteReader& in, std::vector<CameraExposure>& exposures) {
  for (CameraExposure& e : exposures) {
    e.longest_ns = in.number<std::int64_t>();
    const auto count = in.number<std::uint32_t>();
    if (in.fits(count, 12)) e.reports.resize(count);
    for (CameraExposure::Report& report : e.reports) {
      report.exposure_ns = in.number<std::int64_t>();
      report.gain = in.number<float>();
    }
  }
}

void read_profiles(ByteReader& in, std::vector<ProfilePacket>& packets) {
  const auto count = in.number<std::uint64_t>();
  if (in.fits(count, 32)) packets.resize(count);
  for (ProfilePacket& p : packets) {
    p.first_pulse_gps_ns = in.number<GpsNs>();
    p.line = in.number<std::uint32_t>();
    p.angle = in.number<std::uint32_t>();
    p.angle_step = in.number<std::int32_t>();
    p.period_ps = in.number<std::uint32_t>();
    const auto pulses = in.number<std::uint32_t>(), returns = in.number<std::uint32_t>();
    if (!in.fits(pulses, 1) || !in.fits(returns, 6)) return;
    p.counts.resize(pulses);
    p.range_100um.resize(returns);
    p.reflectance_1e4.resize(returns);
    in.bytes(p.counts.data(), pulses);
    in.bytes(p.range_100um.data(), std::size_t{4} * returns);
    in.bytes(p.reflectance_1e4.data(), std::size_t{2} * returns);
  }
}

void read_wheel(ByteReader& in, std::vector<WheelSample>& samples) {
  const auto count = in.number<std::uint64_t>();
  if (in.fits(count, 48)) samples.resize(count);
  for (WheelSample& s : samples) {
    s.gps_ns = in.number<GpsNs>();
    for (double& x : s.speed) x = in.number<double>();
    for (std::uint32_t& x : s.pulses) x = in.number<std::uint32_t>();
  }
}

}  // namespace

Status write_drive(const Drive& d, const std::string& path) {
  ByteWriter out(path);
  out.bytes(kDriveMagic, 8);
  for (const double x : {d.origin_latitude_rad, d.origin_longitude_rad, d.origin_height_m}) out.number(x);
  out.number(d.begin_gps_ns);
  out.number(d.end_gps_ns);
  out.number(static_cast<std::uint64_t>(d.ins.size()));
  for (const InsSample& s : d.ins) {
    out.number(s.gps_ns);
    for (const double x : {s.latitude_rad, s.longitude_rad, s.ellipsoidal_height_m, s.velocity_east, s.velocity_north,
                           s.velocity_up, s.roll_rad, s.pitch_rad, s.heading_rad})
      out.number(x);
    for (const double x : s.sigma) out.number(x);
    out.number(s.status);
    out.number(static_cast<std::uint8_t>(s.has_gnss));
  }
  out.number(static_cast<std::uint64_t>(d.laser.size()));
  for (const LaserPacket& p : d.laser) {
    out.number(p.first_firing_gps_ns);
    out.bytes(p.azimuth_centideg.data(), 24);
    out.bytes(p.distance_2mm.data(), 2 * kSlots);
    out.bytes(p.reflectivity.data(), kSlots);
  }
  out.number(static_cast<std::uint64_t>(d.exposures.size()));
  for (const CameraExposure& e : d.exposures) {
    out.number(e.number);
    out.number(e.exposure_start_gps_ns);
    out.number(e.exposure_ns);
    out.number(e.width);
    out.number(e.height);
    out.text(e.image_file);
  }
  out.number(static_cast<std::uint64_t>(d.pps_edge_error_ns.size()));
  for (const auto e : d.pps_edge_error_ns) out.number(e);
  // Drives without a profile scanner and a wheel encoder end here, as they did before these existed.
  const bool has_reports =
      std::ranges::any_of(d.exposures, [](const CameraExposure& e) { return !e.reports.empty() || e.longest_ns != 0; });
  if (!d.profile.empty() || !d.wheel.empty() || has_reports) out.number(static_cast<std::uint64_t>(d.profile.size()));
  for (const ProfilePacket& p : d.profile) {
    out.number(p.first_pulse_gps_ns);
    for (const std::uint32_t x : {p.line, p.angle, static_cast<std::uint32_t>(p.angle_step), p.period_ps})
      out.number(x);
    out.number(static_cast<std::uint32_t>(p.counts.size()));
    out.number(static_cast<std::uint32_t>(p.range_100um.size()));
    out.bytes(p.counts.data(), p.counts.size());
    out.bytes(p.range_100um.data(), 4 * p.range_100um.size());
    out.bytes(p.reflectance_1e4.data(), 2 * p.reflectance_1e4.size());
  }
  if (!d.wheel.empty() || has_reports) out.number(static_cast<std::uint64_t>(d.wheel.size()));
  for (const WheelSample& s : d.wheel) {
    out.number(s.gps_ns);
    for (const double x : s.speed) out.number(x);
    for (const std::uint32_t x : s.pulses) out.number(x);
  }
  for (std::size_t i = 0; has_reports && i < d.exposures.size(); ++i) {
    const CameraExposure& e = d.exposures[i];
    out.number(e.longest_ns);
    out.number(static_cast<std::uint32_t>(e.reports.size()));
    for (const CameraExposure::Report& report : e.reports) {
      out.number(report.exposure_ns);
      out.number(report.gain);
    }
  }
  return out.close();
}

Result<Drive> read_drive(const std::string& path) {
  ByteReader in(path);
  Drive d;
  char magic[8] = {};
  in.bytes(magic, 8);
  if (in.status().ok() && std::memcmp(magic, kDriveMagic, 8) != 0) in.fail("is not a drive of the simulator");
  for (double* x : {&d.origin_latitude_rad, &d.origin_longitude_rad, &d.origin_height_m}) *x = in.number<double>();
  d.begin_gps_ns = in.number<GpsNs>();
  d.end_gps_ns = in.number<GpsNs>();
  read_trajectory(in, d.ins);
  read_laser(in, d.laser);
  read_exposures(in, d.exposures);
  const auto edges = in.number<std::uint64_t>();
  if (in.fits(edges, 8)) d.pps_edge_error_ns.resize(edges);
  for (auto& e : d.pps_edge_error_ns) e = in.number<std::int64_t>();
  // A drive without a profile scanner, a wheel encoder and a camera that reports ends here.
  if (in.status().ok() && in.left() != 0) read_profiles(in, d.profile);
  if (in.status().ok() && in.left() != 0) read_wheel(in, d.wheel);
  if (in.status().ok() && in.left() != 0) read_reports(in, d.exposures);
  if (in.status().ok() && in.left() != 0) in.fail("goes on after its end");
  if (!in.status().ok()) return in.status().error();
  d.cache_dir = std::filesystem::path(path).parent_path().string();
  return d;
}

}  // namespace hueline::sim
