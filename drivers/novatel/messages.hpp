#pragma once

#include <optional>
#include <string>

#include "core/measurements.hpp"
#include "drivers/novatel/wire.hpp"

/// Bodies of OEM7 messages -> our vocabulary. Pure; `sensor` and `received` are left to the caller. Empty when a field
/// is outside what it can mean (week 0 before the receiver knows the time, NaN, latitude beyond 90 deg).
///
/// Attitude. SPAN gives roll as a right-handed rotation about y (forward), pitch as a right-handed rotation about x
/// (right), azimuth as a left-handed rotation about z (up) from north: right side down, nose up and clockwise are
/// positive, the order is z, x, y. That is core's Attitude and rotation_enu_body(): only degrees change. SPAN's vehicle
/// frame is Body. Height. INSPVA, INSPVAS and MARKxPVA give the ellipsoidal height; INSPVAX and BESTPOS give the height
/// above the geoid and the undulation beside it. Both come out ellipsoidal.
namespace hueline::drivers {

/// Empty unless 0 < week < 10000 and 0 <= seconds < 604800.
std::optional<GpsTime> novatel_time(std::uint32_t week, double seconds);
std::optional<GpsTime> header_time(const NovatelHeader& header);

constexpr std::uint32_t kInsAlignmentComplete = 7;
/// Inertial solution status: 3 INS_SOLUTION_GOOD, and 6 INS_SOLUTION_FREE (filter in navigation mode and within its
/// limits, doubtful GNSS rejected: the ordinary state between tall buildings). Not 2 (high variance), 7 (aligned, not
/// yet within specification).
bool is_good_ins_status(std::uint32_t status);
/// The manual's words for it (OEM7 Commands and Logs Reference, "Inertial Solution Status"), for people; "status 5" for
/// a number that it does not have.
std::string ins_status_name(std::uint32_t status);
/// The filter navigates: attitude means something.
bool has_ins_attitude(std::uint32_t status);

std::optional<InsSolution> decode_inspva(std::span<const std::byte> body);                                ///< 88 bytes
std::optional<InsSolution> decode_inspvax(const NovatelHeader& header, std::span<const std::byte> body);  ///< 126 bytes
std::optional<InsUncertainty> decode_insstdev(const NovatelHeader& header, std::span<const std::byte> body);
std::optional<GnssFix> decode_bestpos(const NovatelHeader& header, std::span<const std::byte> body);

/// TIME. The header's second is the one the latest PPS edge began. The wire's UTC offset is UTC - GPS (-18 s), ours GPS
/// - UTC (+18 s); given only if the receiver calls it valid. `contradicts_utc`: the calendar time beside it names
/// another second.
struct DecodedTime {
  TimeLabel label;
  bool contradicts_utc = false;
};
std::optional<DecodedTime> decode_time(const NovatelHeader& header, std::span<const std::byte> body);

/// MARKxTIME: the active edge on the receiver's own scale, which INS solutions and TIME share. Valid if the time status
/// is fine, the clock model valid and the clock within 1 us of GPS.
std::optional<EventMark> decode_marktime(const NovatelHeader& header, int input, std::span<const std::byte> body);
/// MARKxPVA: the instant alone. Its pose belongs to whatever frame SETINSTRANSLATION MARKx and SETINSROTATION MARKx
/// name, not to Body, so it is not mixed with the solution.
std::optional<EventMark> decode_markpva(const NovatelHeader& header, int input, std::span<const std::byte> body);

/// Position type -> kind of fix, converging PPP counted as Ppp: its sigma says the rest.
FixType fix_type(std::uint32_t position_type);

}  // namespace hueline::drivers
