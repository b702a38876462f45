#include "sim/wire/profile_encode.hpp"

#include <fmt/format.h>

#include <numeric>

#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr std::size_t kDataHeadBytes = 44, kStatusBytes = 32, kMostBytes = 65'507;
constexpr std::uint8_t kData = 1, kStatus = 2, kUnixScale = 1;
constexpr std::int64_t kUnixOfGpsEpoch_s = 315'964'800;

std::int64_t unix_ns(GpsNs t) { return t + (kUnixOfGpsEpoch_s - kGpsMinusUtcSeconds) * kNsPerSecond; }

void put_head(LittleEndianWriter& out, std::uint8_t kind, std::uint32_t counter, std::size_t length, GpsNs time,
              std::uint16_t scanner) {
  out.put_text("PRF1");
  out.put(std::uint8_t{1});
  out.put(kind);
  out.put(scanner);
  out.put(counter);
  out.put(static_cast<std::uint16_t>(length));
  out.put(kUnixScale);
  out.put_zeros(1);
  out.put(static_cast<std::uint32_t>(unix_ns(time) / kNsPerSecond));
  out.put(static_cast<std::uint32_t>(unix_ns(time) % kNsPerSecond));
}

}  // namespace

Result<Bytes> encode_profile_data(const ProfilePacket& p, std::uint32_t counter, std::uint16_t scanner) {
  const std::size_t returns = p.range_100um.size(), length = kDataHeadBytes + p.counts.size() + 6 * returns;
  const auto counted = std::accumulate(p.counts.begin(), p.counts.end(), std::size_t{0});
  if (counted != returns || p.reflectance_1e4.size() != returns || length > kMostBytes)
    return Error{ErrorCode::Invalid,
                 fmt::format("a profile datagram of {} pulses with {} returns, but {} ranges and {} reflectances",
                             p.counts.size(), counted, returns, p.reflectance_1e4.size())};
  LittleEndianWriter out(length);
  put_head(out, kData, counter, length, p.first_pulse_gps_ns, scanner);
  out.put(p.line);
  out.put(p.angle);
  out.put(p.angle_step);
  out.put(p.period_ps);
  out.put(static_cast<std::uint16_t>(p.counts.size()));
  out.put(static_cast<std::uint16_t>(returns));
  for (const std::uint8_t count : p.counts) out.put(count);
  for (std::size_t i = 0; i < returns; ++i) {
    out.put(p.range_100um[i]);
    out.put(p.reflectance_1e4[i]);
  }
  return out.take();
}

Bytes encode_profile_status(const ProfileStatusReport& report) {
  LittleEndianWriter out(kStatusBytes);
  put_head(out, kStatus, report.counter, kStatusBytes, report.sent_gps_ns, report.scanner);
  out.put(report.pps_status);
  out.put(static_cast<std::uint8_t>((report.has_label ? 1 : 0) | (report.is_label_valid ? 2 : 0)));
  out.put_zeros(2);
  out.put(static_cast<std::uint32_t>(unix_ns(report.sent_gps_ns) / kNsPerSecond));
  return out.take();
}

}  // namespace hueline::sim
