#include "sim/wire/velodyne_encode.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr std::size_t kReservedBytes = 198;
constexpr std::size_t kSentenceBytes = 128;
constexpr double kMetresPerSecondPerKnot = 1852.0 / 3600.0;

/// Returns degrees and minutes without a separator. The angle is rounded to 1e-7 minutes before it is divided, so that
/// 59.99999999 minutes are not written as 60.0000000.
std::string degrees_minutes(double angle_rad, int degree_digits) {
  constexpr std::int64_t kUnitsPerDegree = 60LL * 10'000'000LL;
  const auto units = static_cast<std::int64_t>(
      std::llround(std::abs(angle_rad) * 180.0 / std::numbers::pi * static_cast<double>(kUnitsPerDegree)));
  const std::int64_t minutes_1e7 = units % kUnitsPerDegree;
  return fmt::format("{:0{}d}{:02d}.{:07d}", units / kUnitsPerDegree, degree_digits, minutes_1e7 / 10'000'000,
                     minutes_1e7 % 10'000'000);
}

}  // namespace

std::int64_t last_firing_offset_ns(LaserModel model, LaserReturnMode mode) {
  const bool is_dual = mode == LaserReturnMode::Dual;
  if (model == LaserModel::Vlp16) return (is_dual ? 11 : 23) * 55'296LL + 15 * 2'304LL;
  return (is_dual ? 5 : 11) * 46'080LL + 31 * 1'152LL;
}

Result<Bytes> encode_laser_data(const LaserPacket& packet, LaserModel model, LaserReturnMode mode) {
  constexpr std::size_t kReturns = kLaserBlocks * kLaserChannelsPerBlock;
  if (packet.distance_2mm.size() != kReturns || packet.reflectivity.size() != kReturns) {
    return Error{ErrorCode::Invalid, fmt::format("a laser packet holds {} distances and {} reflectivities, not {}",
                                                 packet.distance_2mm.size(), packet.reflectivity.size(), kReturns)};
  }
  LittleEndianWriter out(kLaserDataBytes);
  for (std::size_t block = 0; block < kLaserBlocks; ++block) {
    if (packet.azimuth_centideg[block] >= 36000) {
      return Error{ErrorCode::Invalid,
                   fmt::format("azimuth {} of block {} is not below 36000", packet.azimuth_centideg[block], block)};
    }
    out.put(std::uint16_t{0xEEFF});  // bytes FF EE on the wire
    out.put(packet.azimuth_centideg[block]);
    for (std::size_t laser = 0; laser < kLaserChannelsPerBlock; ++laser) {
      out.put(packet.distance_2mm[block * kLaserChannelsPerBlock + laser]);
      out.put(packet.reflectivity[block * kLaserChannelsPerBlock + laser]);
    }
  }
  out.put(microseconds_past_utc_hour(packet.first_firing_gps_ns));
  out.put(static_cast<std::uint8_t>(mode));
  out.put(static_cast<std::uint8_t>(model));
  return out.take();
}

Result<Bytes> encode_laser_position(const LaserPositionReport& report) {
  if (report.nmea.size() >= kSentenceBytes) {
    return Error{ErrorCode::Invalid, fmt::format("a sentence of {} bytes does not fit into a position datagram ({})",
                                                 report.nmea.size(), kSentenceBytes - 1)};
  }
  LittleEndianWriter out(kLaserPositionBytes);
  out.put_zeros(kReservedBytes);
  out.put(microseconds_past_utc_hour(report.sent_gps_ns));
  out.put(report.pps_status);
  out.put_zeros(3);
  out.put_text(report.nmea);
  out.put_zeros(kLaserPositionBytes - out.size());
  return out.take();
}

std::string encode_gprmc(const RmcReport& report) {
  const UtcFields utc = utc_fields(report.gps_ns);
  double course_deg = report.course_rad * 180.0 / std::numbers::pi;
  if (course_deg < 0) course_deg += 360.0;
  const std::string body = fmt::format(
      "GPRMC,{:02d}{:02d}{:02d}.{:02d},{},{},{},{},{},{:.3f},{:.1f},{:02d}{:02d}{:02d},0.0,E,{}", utc.hour, utc.minute,
      utc.second, utc.nanosecond / 10'000'000, report.is_valid ? 'A' : 'V', degrees_minutes(report.latitude_rad, 2),
      report.latitude_rad < 0 ? 'S' : 'N', degrees_minutes(report.longitude_rad, 3),
      report.longitude_rad < 0 ? 'W' : 'E', report.speed_m_s / kMetresPerSecondPerKnot, course_deg, utc.day, utc.month,
      utc.year % 100, report.is_valid ? 'A' : 'N');
  unsigned checksum = 0;
  for (const char c : body) checksum ^= static_cast<unsigned char>(c);
  return fmt::format("${}*{:02X}\r\n", body, checksum);
}

}  // namespace hueline::sim
