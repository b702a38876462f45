#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/buffer.hpp"
#include "core/fault.hpp"
#include "core/frames.hpp"
#include "core/geodesy.hpp"
#include "core/laser_time.hpp"
#include "core/time.hpp"

/// The measurements that decoders make from bytes, in SI units, radians and the frames of core/frames.hpp. In every
/// measurement, `received` is the arrival at the computer, and `time` is the instant of the measurement, on the clock
/// that its type names. Decoders read no clock; sync/ turns host and device times into GpsTime.
namespace hueline {

/// The kind of a GNSS position, from none to the most accurate.
enum class FixType : std::uint8_t { None, Single, Dgnss, RtkFloat, RtkFixed, Ppp };
/// Returns the enumerator's name.
const char* name(FixType type);

/// A rising edge of the pulse per second: the edge that the receiver declares to be the second.
struct PpsEdge {
  SensorId sensor{};
  HostTime edge{};             ///< the kernel's stamp of the edge
  std::uint64_t sequence = 0;  ///< the source's own count of edges; a gap means lost edges
};

/// A device's statement "the latest whole second was this GPS second": a receiver's time message or a scanner's status.
/// It arrives after that second, usually 1 to 700 ms late, sometimes more than a second.
struct TimeLabel {
  SensorId sensor{};
  HostTime received{};
  GpsTime second{};                                ///< a whole second, already converted to GPS time
  std::optional<std::chrono::seconds> utc_offset;  ///< GPS time minus UTC, if the receiver knows it
  bool is_valid = false;  ///< the device itself considers its time valid: its clock is good and its fix is valid
  /// The fix is valid, and the device's clock agrees with it within two seconds: the hour is right, also where nothing
  /// disciplines that clock and the second may be wrong. Only scanners that count within the hour set it.
  bool names_hour = false;
};

/// The time of a message that carries GPS time and arrives soon after that time. Because it cannot arrive before the
/// event, it bounds the offset of the host clock from one side (arrival >= event).
struct TimedArrival {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
};

/// What a laser scanner reports about its own clock. Which second it is, the scanner reports in a TimeLabel.
struct LaserStatus {
  SensorId sensor{};
  HostTime received{};
  std::optional<LaserTime> time;  ///< the scanner's clock when it sent this report, if the report contains it
  /// State of the scanner's clock. Unlocked: it runs free, because the reference at the scanner's input is missing or
  /// broken. Acquiring: it is being set to its reference (a pulse per second, or PTP). Locked: it follows the
  /// reference. Holdover: it followed the reference until a moment ago.
  SyncState clock = SyncState::Unlocked;
  std::string words;  ///< the same in the device's own terms, for people: "PPS locked, GPRMC valid"
};

/// The POS's navigation solution at `time`: the pose and velocity of Body in the local level at `position`.
struct InsSolution {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
  Geodetic position{};  ///< no place on earth (is_on_earth()) if the device knows none; the solution is not good then
  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();  ///< m/s
  Attitude attitude{};
  /// The device declares the solution good (NovAtel: INS_SOLUTION_GOOD or better). Other solutions are recorded and
  /// marked, but fusion does not use them.
  bool is_good = false;
  std::uint32_t status = 0;  ///< the receiver's own status number
  /// One sigma of each value, if the message contains it: position east, north, up (m); velocity east, north, up (m/s);
  /// roll, pitch, heading (rad).
  std::optional<std::array<double, 9>> sigma;
};
/// One sigma of the current solution, from a message of its own (NovAtel INSSTDEV). The order is that of
/// InsSolution::sigma.
struct InsUncertainty {
  SensorId sensor{};
  GpsTime time{};
  std::array<double, 9> sigma{};
};

/// A position from the GNSS receiver alone.
struct GnssFix {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
  FixType type = FixType::None;
  Geodetic position{};
  std::array<double, 3> sigma_enu{};  ///< m
  int satellites = 0;
  /// The height is above the ellipsoid. It is false if the device gives none, or one above the geoid without the
  /// geoid's own height; `sigma_enu` is wide enough for that.
  bool has_height = true;
};

/// One sample of the inertial measurement unit, in the axes of Body.
struct ImuSample {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
  Eigen::Vector3d specific_force_body = Eigen::Vector3d::Zero();  ///< m/s^2
  Eigen::Vector3d angular_rate_body = Eigen::Vector3d::Zero();    ///< rad/s
};

/// An edge at the POS's event input, stamped by the receiver. It is the strobe of an exposure.
struct EventMark {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};                 ///< the active edge at the input
  int input = 1;                  ///< number of the event input, 1 to 4 (MARK1TIME to MARK4TIME)
  bool is_valid = false;          ///< the receiver's time status is good
  std::uint32_t pulse_count = 0;  ///< the receiver's count of its marks; 0 if it does not count them
};

/// What the vehicle's wheel encoder reports in one message on its bus: a speed, a distance counted in pulses, or both.
/// The values are the mean of the wheels that the message names.
struct WheelSpeed {
  SensorId sensor{};
  HostTime received{};  ///< end of the message's frame on the bus, as the kernel stamped it
  /// The end of the frame on the adapter's own counter, if the adapter has one.
  std::optional<DeviceTime<CanAdapterCounter>> adapter_time;
  std::optional<double> speed;  ///< m/s along the vehicle; negative when driving backwards, if the encoder can tell
  double sigma = 0;             ///< one sigma of `speed`, m/s
  /// Distance since the sensor's first message, m. Wraps and restarts of the encoder's counters are already removed.
  std::optional<double> distance_m;
  bool is_directional = false;  ///< the encoder distinguishes backwards from forwards
};

/// One laser return, 32 bytes.
struct LaserReturn {
  /// Position in the Scanner frame, m.
  float x = 0, y = 0, z = 0;
  float range_m = 0;
  float azimuth = 0;                ///< rad, [0, 2 pi), in the scanner's own sense of counting
  std::int32_t time_offset_ns = 0;  ///< time of the firing minus LaserBatch::time
  std::uint16_t channel = 0;        ///< ring of the scanner, counted from the lowest elevation
  std::uint8_t reflectivity = 0;
  std::uint8_t return_number = 1;  ///< counted by range; 1 is the nearest
  std::uint8_t return_count = 1;   ///< number of returns of this firing
  std::uint8_t flags = 0;
  std::uint16_t reserved = 0;
};
static_assert(sizeof(LaserReturn) == 32);

/// The returns of one packet.
struct LaserBatch {
  SensorId sensor{};
  HostTime received{};
  std::uint64_t packet_sequence = 0;  ///< the packet's sequence in the journal
  LaserTime time{};                   ///< the packet's own stamp: the time of its first firing
  std::vector<LaserReturn> returns;
};

/// Layout of an image's pixels. A Bayer format is named by the first two pixels of its first row.
enum class PixelFormat : std::uint8_t { Mono8, BayerRG8, BayerBG8, BayerGR8, BayerGB8, Rgb8 };
/// Returns the enumerator's name.
const char* name(PixelFormat format);

/// Returns the rows down to the next one with the same colours.
inline std::uint8_t rows_of_pattern(PixelFormat format) {
  return format == PixelFormat::Mono8 || format == PixelFormat::Rgb8 ? 1 : 2;
}

/// A rectangle of an image, in pixels.
struct PixelRegion {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

/// What a camera itself says of how it exposed an image, or a part of it. One that exposes automatically is the only
/// one that knows.
struct ReportedExposure {
  PixelRegion region{};     ///< the part of the image that this is about; without width: the whole image
  nanoseconds duration{0};  ///< of the exposure; 0: the camera does not say
  float gain = 0;           ///< factor of its amplifier on pixel values; 0: the camera does not say
};

/// One image that a camera delivered. The pixels stay in the packet's buffer, unless they had to be decoded.
struct Image {
  SensorId sensor{};
  HostTime received{};  ///< arrival of the image's last byte
  std::uint64_t packet_sequence = 0;
  std::uint64_t frame_id = 0;  ///< the camera's own number; a gap means lost images, a smaller number means a restart
  DeviceTime<CameraCounter> time{};  ///< the camera's stamp; the rig says which event it names
  std::uint32_t width = 0, height = 0, stride = 0;
  PixelFormat format = PixelFormat::BayerRG8;
  bool is_complete = false;  ///< no packet is missing; an incomplete image is recorded, but not used for colour
  std::uint32_t missing_packets = 0;
  Buffer buffer;                           ///< the whole packet, or the pixels that were decoded from it
  std::size_t pixel_offset = 0;            ///< offset of the first pixel in `buffer`
  std::vector<PixelRegion> lost;           ///< parts of a complete image that could not be decoded; they give no colour
  std::vector<ReportedExposure> reported;  ///< what the camera says of its exposure; empty: nothing

  std::span<const std::byte> pixels() const { return buffer.bytes().subspan(pixel_offset); }
};

/// Any measurement; the output of decoders.
using Measurement = std::variant<PpsEdge, TimeLabel, TimedArrival, LaserStatus, InsSolution, InsUncertainty, GnssFix,
                                 ImuSample, EventMark, LaserBatch, Image, WheelSpeed, Fault>;

}  // namespace hueline
