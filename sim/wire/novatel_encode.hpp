#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "sim/drive.hpp"
#include "sim/wire/little_endian.hpp"

/// Encoders of NovAtel OEM7 binary logs (OEM7 Commands and Logs Reference Manual, OM-20000169). The structs hold what
/// the wire holds, in the units of the wire (degrees, m, m/s), so that a recorded message can be encoded again bit for
/// bit. Pure functions, reentrant.
namespace hueline::sim {

/// Message ids of the manual.
enum class NovatelId : std::uint16_t {
  Bestpos = 42,
  Time = 101,
  Inspva = 507,
  Inspvas = 508,
  Mark1Pva = 1067,
  Mark1Time = 1130,
  Rawimusx = 1462,
  Inspvax = 1465,
  Insstdev = 2051,
  Insstdevs = 2052,
};

/// A log that the simulated receiver can send, with the name that the LOG command takes (without the format letter).
struct NovatelLog {
  std::string_view name;
  NovatelId id;
  bool has_short_header;
};
/// Returns all logs that the simulated receiver can send.
std::span<const NovatelLog> novatel_logs();

/// Fields of both kinds of header. The short one carries only week and milliseconds.
struct NovatelHeader {
  std::uint8_t port = 0x20;  ///< COM1
  std::uint16_t sequence = 0;
  std::uint8_t idle_time = 0x9C;   ///< in half percents
  std::uint8_t time_status = 180;  ///< FINESTEERING
  std::uint16_t week = 0;
  std::uint32_t milliseconds = 0;  ///< of the week
  std::uint32_t receiver_status = 0x02000020;
  std::uint16_t reserved = 0;
  std::uint16_t software_version = 16248;
};
/// Returns the header of a log about this time; milliseconds are rounded to the nearest.
NovatelHeader novatel_header(GpsNs gps_ns);

/// Position, velocity and attitude: INSPVA, INSPVAS and MARKxPVA.
struct PvaFields {
  std::uint32_t week = 0;
  double seconds = 0;
  double latitude_deg = 0, longitude_deg = 0, ellipsoidal_height_m = 0;
  double velocity_north = 0, velocity_east = 0, velocity_up = 0;
  double roll_deg = 0, pitch_deg = 0, azimuth_deg = 0;
  std::uint32_t status = 3;  ///< INS_SOLUTION_GOOD
};
/// Returns the fields of a log about a sample; the functions below do the same for the other logs.
PvaFields pva_fields(const InsSample& sample);
/// Encodes a log; `id` is Inspva, Inspvas or Mark1Pva.
Bytes encode_pva(NovatelId id, const NovatelHeader& header, const PvaFields& fields);

/// One sigma of the solution, in m, m/s and degrees.
struct StdevFields {
  float latitude_m = 0, longitude_m = 0, height_m = 0;
  float velocity_north = 0, velocity_east = 0, velocity_up = 0;
  float roll_deg = 0, pitch_deg = 0, azimuth_deg = 0;
  std::uint32_t extended_status = 0;
  std::uint16_t time_since_update = 0;
  std::uint16_t reserved1 = 0;
  std::uint32_t reserved2 = 0, reserved3 = 0;
};
StdevFields stdev_fields(const InsSample& sample);
/// Encodes a log; `id` is Insstdev or Insstdevs.
Bytes encode_stdev(NovatelId id, const NovatelHeader& header, const StdevFields& fields);

/// INSPVAX. Its height is orthometric: ellipsoidal height = height + undulation.
struct PvaxFields {
  std::uint32_t status = 3;
  std::uint32_t position_type = 56;  ///< INS_RTKFIXED
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
  float undulation_m = 0;
  double velocity_north = 0, velocity_east = 0, velocity_up = 0;
  double roll_deg = 0, pitch_deg = 0, azimuth_deg = 0;
  StdevFields sigma;  ///< its reserved fields are not sent
};
PvaxFields pvax_fields(const InsSample& sample, double undulation_m);
Bytes encode_pvax(const NovatelHeader& header, const PvaxFields& fields);

/// BESTPOS. Its height is orthometric as in INSPVAX.
struct BestposFields {
  std::uint32_t solution_status = 0;  ///< SOL_COMPUTED
  std::uint32_t position_type = 56;
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
  float undulation_m = 0;
  std::uint32_t datum = 61;  ///< WGS84
  float sigma_latitude_m = 0, sigma_longitude_m = 0, sigma_height_m = 0;
  std::array<char, 4> station{};
  float differential_age_s = 0, solution_age_s = 0;
  std::uint8_t tracked = 24, used = 22, used_l1 = 22, used_multi = 20;
  std::uint8_t reserved = 0, extended_status = 0, galileo_beidou_mask = 0, gps_glonass_mask = 0x33;
};
BestposFields bestpos_fields(const InsSample& sample, double undulation_m);
Bytes encode_bestpos(const NovatelHeader& header, const BestposFields& fields);

/// TIME: UTC = GPS reference time + `offset_s` + `utc_offset_s`.
struct TimeFields {
  std::uint32_t clock_status = 0;  ///< VALID
  double offset_s = 0, offset_sigma_s = 20e-9;
  double utc_offset_s = -18;
  std::uint32_t year = 0;
  std::uint8_t month = 0, day = 0, hour = 0, minute = 0;
  std::uint32_t milliseconds = 0;
  std::uint32_t utc_status = 1;  ///< VALID
};
TimeFields time_fields(GpsNs gps_ns);
Bytes encode_time(const NovatelHeader& header, const TimeFields& fields);

/// MARK1TIME: the GPS time of an edge at event input 1.
struct MarkTimeFields {
  std::uint32_t week = 0;
  double seconds = 0;
  double offset_s = 0, offset_sigma_s = 20e-9;
  double utc_offset_s = -18;
  std::uint32_t clock_status = 0;  ///< VALID
};
MarkTimeFields mark_time_fields(GpsNs gps_ns);
Bytes encode_mark1_time(const NovatelHeader& header, const MarkTimeFields& fields);

/// RAWIMUSX: the counts of one IMU interval in the IMU's own units and axes. The order on the wire is z, -y, x.
struct RawImuFields {
  std::uint8_t info = 0;
  std::uint8_t imu_type = 0;
  std::uint16_t week = 0;
  double seconds = 0;
  std::uint32_t imu_status = 0;
  std::int32_t z_accel = 0, minus_y_accel = 0, x_accel = 0;
  std::int32_t z_gyro = 0, minus_y_gyro = 0, x_gyro = 0;
};
Bytes encode_rawimusx(const NovatelHeader& header, const RawImuFields& fields);

/// Returns the CRC-32 as NovAtel computes it: polynomial 0xEDB88320 (reflected), initial value 0, no final inversion.
std::uint32_t novatel_crc32(std::span<const std::byte> bytes);

/// Message id and milliseconds of the week of an encoded log; id 0 if the log is too short.
struct NovatelPeek {
  std::uint16_t id = 0;
  std::uint32_t milliseconds = 0;
};
/// Returns id and milliseconds of an encoded log, with either kind of header.
NovatelPeek peek_novatel(std::span<const std::byte> message);

}  // namespace hueline::sim
