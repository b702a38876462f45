#pragma once

#include <optional>
#include <string>

#include "core/measurements.hpp"
#include "drivers/novatel/wire.hpp"

/// Decodes the bodies of OEM7 messages. The functions depend on their arguments only; the caller fills in `sensor` and
/// `received`. They return nothing if a field has an impossible value (week 0 before the receiver knows the time, NaN,
/// latitude beyond 90 degrees).
///
/// Attitude: SPAN gives roll as a right-handed rotation about y (forward), pitch as a right-handed rotation about x
/// (right), and azimuth as a left-handed rotation about z (up) from north. So right side down, nose up and clockwise
/// are positive, and the order is z, x, y. core's Attitude and rotation_enu_body() have the same convention, so only
/// the unit changes, from degrees to radians. SPAN's vehicle frame is Body.
///
/// Height: INSPVA, INSPVAS and MARKxPVA give the ellipsoidal height. INSPVAX and BESTPOS give the height above the
/// geoid and the undulation. The result is ellipsoidal for all of them.
namespace hueline::drivers {

/// Returns the GPS time of a week and its second. Returns nothing unless 0 < week < 10000 and 0 <= seconds < 604800.
std::optional<GpsTime> novatel_time(std::uint32_t week, double seconds);
/// Returns the GPS time in a header, under the same conditions.
std::optional<GpsTime> header_time(const NovatelHeader& header);

constexpr std::uint32_t kInsAlignmentComplete = 7;
/// Returns whether an inertial solution status is good: 3, INS_SOLUTION_GOOD, or 6, INS_SOLUTION_FREE (the filter
/// navigates within its limits and rejects doubtful GNSS, as is usual between tall buildings). Not good are 2 (high
/// variance) and 7 (aligned, not yet within specification).
bool is_good_ins_status(std::uint32_t status);
/// Returns a status in words for people (OEM7 Commands and Logs Reference Manual, "Inertial Solution Status"), or
/// "status 5" for a number that the manual does not have.
std::string ins_status_name(std::uint32_t status);
/// Returns whether the filter navigates at this status, so that its attitude has a meaning.
bool has_ins_attitude(std::uint32_t status);

/// A filter that does not navigate yet (has_ins_attitude() is false) sends the centre of the earth, or anything else,
/// as its place. Its solutions are given all the same, not good: its status is what the user must be told.
std::optional<InsSolution> decode_inspva(std::span<const std::byte> body);                                ///< 88 bytes
std::optional<InsSolution> decode_inspvax(const NovatelHeader& header, std::span<const std::byte> body);  ///< 126 bytes
std::optional<InsUncertainty> decode_insstdev(const NovatelHeader& header, std::span<const std::byte> body);
std::optional<GnssFix> decode_bestpos(const NovatelHeader& header, std::span<const std::byte> body);

/// The content of a TIME message. The second in its header is the one that began with the latest PPS edge. The message
/// gives UTC - GPS (-18 s); TimeLabel has GPS - UTC (+18 s), and only if the receiver calls its offset valid.
struct DecodedTime {
  TimeLabel label;
  bool contradicts_utc = false;  ///< the calendar time in the message names another second; the label is not valid
};
std::optional<DecodedTime> decode_time(const NovatelHeader& header, std::span<const std::byte> body);

/// Decodes MARKxTIME: the time of the active edge at input `input`, on the receiver's own time scale, which INS
/// solutions and TIME share. It is valid if the time status is fine, the clock model is valid and the clock is within 1
/// us of GPS.
std::optional<EventMark> decode_marktime(const NovatelHeader& header, int input, std::span<const std::byte> body);
/// Decodes the time of MARKxPVA only. Its pose belongs to the frame that SETINSTRANSLATION MARKx and SETINSROTATION
/// MARKx name, not to Body.
std::optional<EventMark> decode_markpva(const NovatelHeader& header, int input, std::span<const std::byte> body);

/// Returns the kind of fix of a position type. PPP that still converges counts as Ppp; its sigma says how good it is.
FixType fix_type(std::uint32_t position_type);

}  // namespace hueline::drivers
