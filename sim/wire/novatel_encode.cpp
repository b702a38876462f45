#include "sim/wire/novatel_encode.hpp"

#include <array>
#include <numbers>

#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kShortHeaderBytes = 12;

constexpr std::array<NovatelLog, 10> kLogs{{
    {"BESTPOS", NovatelId::Bestpos, false},
    {"TIME", NovatelId::Time, false},
    {"INSPVA", NovatelId::Inspva, false},
    {"INSPVAS", NovatelId::Inspvas, true},
    {"MARK1PVA", NovatelId::Mark1Pva, false},
    {"MARK1TIME", NovatelId::Mark1Time, false},
    {"RAWIMUSX", NovatelId::Rawimusx, true},
    {"INSPVAX", NovatelId::Inspvax, false},
    {"INSSTDEV", NovatelId::Insstdev, false},
    {"INSSTDEVS", NovatelId::Insstdevs, true},
}};

constexpr std::array<std::uint32_t, 256> kCrcTable = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0 ? (c >> 1U) ^ 0xEDB88320U : c >> 1U;
    table[i] = c;
  }
  return table;
}();

double seconds_of_week(GpsNs gps_ns) { return static_cast<double>(week_time(gps_ns).time_of_week_ns) * 1e-9; }

/// Returns a whole log: the header that the log's kind needs, the body and the CRC.
Bytes frame(NovatelId id, const NovatelHeader& header, const LittleEndianWriter& body) {
  bool is_short = false;
  for (const NovatelLog& log : kLogs) is_short = is_short || (log.id == id && log.has_short_header);

  LittleEndianWriter out(kHeaderBytes + body.size() + 4);
  out.put(std::uint8_t{0xAA});
  out.put(std::uint8_t{0x44});
  if (is_short) {
    out.put(std::uint8_t{0x13});
    out.put(static_cast<std::uint8_t>(body.size()));
    out.put(static_cast<std::uint16_t>(id));
    out.put(header.week);
    out.put(header.milliseconds);
  } else {
    out.put(std::uint8_t{0x12});
    out.put(static_cast<std::uint8_t>(kHeaderBytes));
    out.put(static_cast<std::uint16_t>(id));
    out.put(std::uint8_t{0});  // binary, original message, primary antenna
    out.put(header.port);
    out.put(static_cast<std::uint16_t>(body.size()));
    out.put(header.sequence);
    out.put(header.idle_time);
    out.put(header.time_status);
    out.put(header.week);
    out.put(header.milliseconds);
    out.put(header.receiver_status);
    out.put(header.reserved);
    out.put(header.software_version);
  }
  for (const std::byte b : body.bytes()) out.put(static_cast<std::uint8_t>(b));
  out.put(novatel_crc32(out.bytes()));
  return out.take();
}

void put_sigma(LittleEndianWriter& out, const StdevFields& f) {
  for (const float value : {f.latitude_m, f.longitude_m, f.height_m, f.velocity_north, f.velocity_east, f.velocity_up,
                            f.roll_deg, f.pitch_deg, f.azimuth_deg}) {
    out.put(value);
  }
  out.put(f.extended_status);
  out.put(f.time_since_update);
}

}  // namespace

std::span<const NovatelLog> novatel_logs() { return kLogs; }

NovatelHeader novatel_header(GpsNs gps_ns) {
  const WeekTime t = week_time(gps_ns + 500'000);
  NovatelHeader header;
  header.week = static_cast<std::uint16_t>(t.week);
  header.milliseconds = static_cast<std::uint32_t>(t.time_of_week_ns / 1'000'000);
  return header;
}

PvaFields pva_fields(const InsSample& sample) {
  PvaFields f;
  f.week = week_time(sample.gps_ns).week;
  f.seconds = seconds_of_week(sample.gps_ns);
  f.latitude_deg = sample.latitude_rad * kDegreesPerRadian;
  f.longitude_deg = sample.longitude_rad * kDegreesPerRadian;
  f.ellipsoidal_height_m = sample.ellipsoidal_height_m;
  f.velocity_north = sample.velocity_north;
  f.velocity_east = sample.velocity_east;
  f.velocity_up = sample.velocity_up;
  f.roll_deg = sample.roll_rad * kDegreesPerRadian;
  f.pitch_deg = sample.pitch_rad * kDegreesPerRadian;
  f.azimuth_deg = sample.heading_rad * kDegreesPerRadian;
  if (f.azimuth_deg < 0) f.azimuth_deg += 360.0;
  f.status = sample.status;
  return f;
}

Bytes encode_pva(NovatelId id, const NovatelHeader& header, const PvaFields& f) {
  LittleEndianWriter out(88);
  out.put(f.week);
  for (const double value : {f.seconds, f.latitude_deg, f.longitude_deg, f.ellipsoidal_height_m, f.velocity_north,
                             f.velocity_east, f.velocity_up, f.roll_deg, f.pitch_deg, f.azimuth_deg}) {
    out.put(value);
  }
  out.put(f.status);
  return frame(id, header, out);
}

StdevFields stdev_fields(const InsSample& sample) {
  const auto& s = sample.sigma;  // order E N U; the wire has latitude (north) before longitude (east)
  StdevFields f;
  f.latitude_m = static_cast<float>(s[1]);
  f.longitude_m = static_cast<float>(s[0]);
  f.height_m = static_cast<float>(s[2]);
  f.velocity_north = static_cast<float>(s[4]);
  f.velocity_east = static_cast<float>(s[3]);
  f.velocity_up = static_cast<float>(s[5]);
  f.roll_deg = static_cast<float>(s[6] * kDegreesPerRadian);
  f.pitch_deg = static_cast<float>(s[7] * kDegreesPerRadian);
  f.azimuth_deg = static_cast<float>(s[8] * kDegreesPerRadian);
  return f;
}

Bytes encode_stdev(NovatelId id, const NovatelHeader& header, const StdevFields& f) {
  LittleEndianWriter out(52);
  put_sigma(out, f);
  out.put(f.reserved1);
  out.put(f.reserved2);
  out.put(f.reserved3);
  return frame(id, header, out);
}

PvaxFields pvax_fields(const InsSample& sample, double undulation_m) {
  const PvaFields pva = pva_fields(sample);
  PvaxFields f;
  f.latitude_deg = pva.latitude_deg;
  f.longitude_deg = pva.longitude_deg;
  f.undulation_m = static_cast<float>(undulation_m);
  // The receiver adds the undulation in the single precision in which it is sent, because its readers do the same.
  f.height_m = pva.ellipsoidal_height_m - static_cast<double>(f.undulation_m);
  f.velocity_north = pva.velocity_north;
  f.velocity_east = pva.velocity_east;
  f.velocity_up = pva.velocity_up;
  f.roll_deg = pva.roll_deg;
  f.pitch_deg = pva.pitch_deg;
  f.azimuth_deg = pva.azimuth_deg;
  f.sigma = stdev_fields(sample);
  f.status = sample.status;
  if (!sample.has_gnss) f.position_type = 53;  // INS_PSRSP: there is no carrier solution any more
  return f;
}

Bytes encode_pvax(const NovatelHeader& header, const PvaxFields& f) {
  LittleEndianWriter out(126);
  out.put(f.status);
  out.put(f.position_type);
  out.put(f.latitude_deg);
  out.put(f.longitude_deg);
  out.put(f.height_m);
  out.put(f.undulation_m);
  for (const double value :
       {f.velocity_north, f.velocity_east, f.velocity_up, f.roll_deg, f.pitch_deg, f.azimuth_deg}) {
    out.put(value);
  }
  put_sigma(out, f.sigma);
  return frame(NovatelId::Inspvax, header, out);
}

BestposFields bestpos_fields(const InsSample& sample, double undulation_m) {
  const PvaxFields pvax = pvax_fields(sample, undulation_m);
  BestposFields f;
  f.position_type = 50;  // NARROW_INT
  if (!sample.has_gnss) {
    f.solution_status = 1;  // INSUFFICIENT_OBS
    f.position_type = 53;
    f.tracked = f.used = f.used_l1 = f.used_multi = 0;
  }
  f.latitude_deg = pvax.latitude_deg;
  f.longitude_deg = pvax.longitude_deg;
  f.height_m = pvax.height_m;
  f.undulation_m = pvax.undulation_m;
  f.sigma_latitude_m = pvax.sigma.latitude_m;
  f.sigma_longitude_m = pvax.sigma.longitude_m;
  f.sigma_height_m = pvax.sigma.height_m;
  return f;
}

Bytes encode_bestpos(const NovatelHeader& header, const BestposFields& f) {
  LittleEndianWriter out(72);
  out.put(f.solution_status);
  out.put(f.position_type);
  out.put(f.latitude_deg);
  out.put(f.longitude_deg);
  out.put(f.height_m);
  out.put(f.undulation_m);
  out.put(f.datum);
  out.put(f.sigma_latitude_m);
  out.put(f.sigma_longitude_m);
  out.put(f.sigma_height_m);
  out.put_text({f.station.data(), f.station.size()});
  out.put(f.differential_age_s);
  out.put(f.solution_age_s);
  for (const std::uint8_t value : {f.tracked, f.used, f.used_l1, f.used_multi, f.reserved, f.extended_status,
                                   f.galileo_beidou_mask, f.gps_glonass_mask}) {
    out.put(value);
  }
  return frame(NovatelId::Bestpos, header, out);
}

TimeFields time_fields(GpsNs gps_ns) {
  const UtcFields utc = utc_fields(gps_ns);
  TimeFields f;
  f.utc_offset_s = -static_cast<double>(kGpsMinusUtcSeconds);
  f.year = static_cast<std::uint32_t>(utc.year);
  f.month = static_cast<std::uint8_t>(utc.month);
  f.day = static_cast<std::uint8_t>(utc.day);
  f.hour = static_cast<std::uint8_t>(utc.hour);
  f.minute = static_cast<std::uint8_t>(utc.minute);
  f.milliseconds = static_cast<std::uint32_t>(utc.second * 1000 + utc.nanosecond / 1'000'000);
  return f;
}

Bytes encode_time(const NovatelHeader& header, const TimeFields& f) {
  LittleEndianWriter out(44);
  out.put(f.clock_status);
  out.put(f.offset_s);
  out.put(f.offset_sigma_s);
  out.put(f.utc_offset_s);
  out.put(f.year);
  for (const std::uint8_t value : {f.month, f.day, f.hour, f.minute}) out.put(value);
  out.put(f.milliseconds);
  out.put(f.utc_status);
  return frame(NovatelId::Time, header, out);
}

MarkTimeFields mark_time_fields(GpsNs gps_ns) {
  MarkTimeFields f;
  f.week = week_time(gps_ns).week;
  f.seconds = seconds_of_week(gps_ns);
  f.utc_offset_s = -static_cast<double>(kGpsMinusUtcSeconds);
  return f;
}

Bytes encode_mark1_time(const NovatelHeader& header, const MarkTimeFields& f) {
  LittleEndianWriter out(40);
  out.put(f.week);
  out.put(f.seconds);
  out.put(f.offset_s);
  out.put(f.offset_sigma_s);
  out.put(f.utc_offset_s);
  out.put(f.clock_status);
  return frame(NovatelId::Mark1Time, header, out);
}

Bytes encode_rawimusx(const NovatelHeader& header, const RawImuFields& f) {
  LittleEndianWriter out(40);
  out.put(f.info);
  out.put(f.imu_type);
  out.put(f.week);
  out.put(f.seconds);
  out.put(f.imu_status);
  for (const std::int32_t value : {f.z_accel, f.minus_y_accel, f.x_accel, f.z_gyro, f.minus_y_gyro, f.x_gyro}) {
    out.put(value);
  }
  return frame(NovatelId::Rawimusx, header, out);
}

std::uint32_t novatel_crc32(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0;
  for (const std::byte b : bytes) crc = kCrcTable[(crc ^ static_cast<std::uint32_t>(b)) & 0xffU] ^ (crc >> 8U);
  return crc;
}

NovatelPeek peek_novatel(std::span<const std::byte> m) {
  const auto u16 = [&](std::size_t at) {
    return static_cast<std::uint16_t>(std::to_integer<unsigned>(m[at]) | std::to_integer<unsigned>(m[at + 1]) << 8U);
  };
  if (m.size() < kShortHeaderBytes) return {};
  const bool is_short = m[2] == std::byte{0x13};
  if (!is_short && m.size() < kHeaderBytes) return {};
  const std::size_t at = is_short ? 8 : 16;
  return {u16(4), u16(at) | static_cast<std::uint32_t>(u16(at + 2)) << 16U};
}

}  // namespace hueline::sim
