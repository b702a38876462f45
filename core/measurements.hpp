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

/// What decoders make of bytes: SI, radians, our frames. `received` is the arrival (host); `time` the measurement, on
/// the clock that its type names. Decoders are pure; sync/ turns host and device times into GpsTime.
namespace hueline {

enum class FixType : std::uint8_t { None, Single, Dgnss, RtkFloat, RtkFixed, Ppp };
const char* name(FixType type);

/// Rising edge of the pulse per second (the edge the receiver names as the second).
struct PpsEdge {
  SensorId sensor{};
  HostTime edge{};             ///< kernel stamp of the edge
  std::uint64_t sequence = 0;  ///< the source's own count; gaps are lost edges
};

/// A device's statement "the latest whole second was this GPS second" (a receiver's time message, a scanner's status).
/// It comes after the second, 1-700 ms late, sometimes more than a second.
struct TimeLabel {
  SensorId sensor{};
  HostTime received{};
  GpsTime second{};                                ///< whole second, already in GPS time
  std::optional<std::chrono::seconds> utc_offset;  ///< GPS - UTC, if the receiver knows it
  bool is_valid = false;  ///< the device holds its time for good: its clock is fine, its fix is valid
};

/// Any message that carries GPS time and arrives soon after: bounds the host clock's offset from one side (arrival >=
/// event).
struct TimedArrival {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
};

/// What a laser scanner says of its own clock. Which second it is, the scanner says by a TimeLabel.
struct LaserStatus {
  SensorId sensor{};
  HostTime received{};
  std::optional<LaserTime> time;  ///< its clock when it sent this, if it says so
  /// Unlocked: free-running, no reference at the scanner's input or a broken one. Acquiring: it is being set to its
  /// reference (a pulse per second, PTP). Locked: held by it. Holdover: held until a moment ago.
  SyncState clock = SyncState::Unlocked;
  std::string words;  ///< the same in the device's own terms, for people: "PPS locked, GPRMC valid"
};

/// The POS's navigation solution at `time`: pose of Body against the local level at `position`.
struct InsSolution {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
  Geodetic position{};
  Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();  ///< m/s
  Attitude attitude{};
  bool is_good =
      false;  ///< solution good (NovAtel INS_SOLUTION_GOOD or better); else recorded and flagged, not trusted
  std::uint32_t status = 0;  ///< the receiver's own number
  /// One sigma, if the message has it: position east, north, up (m); velocity (m/s); roll, pitch, heading (rad).
  std::optional<std::array<double, 9>> sigma;
};
/// One sigma of the running solution, from its own message (NovAtel INSSTDEV); order as InsSolution::sigma.
struct InsUncertainty {
  SensorId sensor{};
  GpsTime time{};
  std::array<double, 9> sigma{};
};

struct GnssFix {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
  FixType type = FixType::None;
  Geodetic position{};
  std::array<double, 3> sigma_enu{};  ///< m
  int satellites = 0;
};

struct ImuSample {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};
  Eigen::Vector3d specific_force_body = Eigen::Vector3d::Zero();  ///< m/s^2
  Eigen::Vector3d angular_rate_body = Eigen::Vector3d::Zero();    ///< rad/s
};

/// An edge at the POS's event input, stamped by the receiver: strobe of an exposure.
struct EventMark {
  SensorId sensor{};
  HostTime received{};
  GpsTime time{};                 ///< the input's active edge
  int input = 1;                  ///< 1..4 (MARK1TIME..MARK4TIME)
  bool is_valid = false;          ///< receiver's time status is fine
  std::uint32_t pulse_count = 0;  ///< if the receiver counts its marks; 0: it does not
};

/// What the vehicle's wheel encoder says in one message on its bus: a speed, or a distance counted in pulses, or both;
/// the mean of the wheels that the message names.
struct WheelSpeed {
  SensorId sensor{};
  HostTime received{};  ///< end of the message's frame on the bus, as the kernel stamped it
  std::optional<DeviceTime<CanAdapterCounter>>
      adapter_time;             ///< the same event by the adapter's own counter, if it has one
  std::optional<double> speed;  ///< m/s along the vehicle; below 0: backwards, where the encoder tells
  double sigma = 0;             ///< one sigma of `speed`, m/s
  std::optional<double>
      distance_m;  ///< counted since the sensor's first message; wraps and restarts of the counters are undone
  bool is_directional = false;  ///< the encoder tells backwards from forwards
};

/// One laser return, 32 bytes. `p_scanner` in metres in the scanner's frame.
struct LaserReturn {
  float x = 0, y = 0, z = 0;
  float range_m = 0;
  float azimuth = 0;                ///< rad, [0, 2 pi), as the scanner counts it
  std::int32_t time_offset_ns = 0;  ///< firing minus LaserBatch::time
  std::uint16_t channel = 0;        ///< ring counted from the lowest elevation
  std::uint8_t reflectivity = 0;
  std::uint8_t return_number = 1;  ///< 1 = the only or strongest/first...
  std::uint8_t return_count = 1;   ///< returns of this firing
  std::uint8_t flags = 0;
  std::uint16_t reserved = 0;
};
static_assert(sizeof(LaserReturn) == 32);

/// The returns of one packet.
struct LaserBatch {
  SensorId sensor{};
  HostTime received{};
  std::uint64_t packet_sequence = 0;  ///< journal sequence of the packet
  LaserTime time{};                   ///< the packet's own stamp: first firing
  std::vector<LaserReturn> returns;
};

enum class PixelFormat : std::uint8_t { Mono8, BayerRG8, BayerBG8, BayerGR8, BayerGB8, Rgb8 };
const char* name(PixelFormat format);

/// A rectangle of an image.
struct PixelRegion {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

/// One delivered image. Pixels stay in the packet's buffer, unless they had to be decoded.
struct Image {
  SensorId sensor{};
  HostTime received{};  ///< last byte here
  std::uint64_t packet_sequence = 0;
  std::uint64_t frame_id = 0;        ///< the camera's own number; gaps are lost images, a fall is a restart
  DeviceTime<CameraCounter> time{};  ///< the camera's stamp (which event: rig setting)
  std::uint32_t width = 0, height = 0, stride = 0;
  PixelFormat format = PixelFormat::BayerRG8;
  bool is_complete = false;  ///< no missing packet; incomplete images are recorded and not used for colour
  std::uint32_t missing_packets = 0;
  Buffer buffer;                  ///< the whole packet, or what was decoded from it
  std::size_t pixel_offset = 0;   ///< of the first pixel inside `buffer`
  std::vector<PixelRegion> lost;  ///< parts of a complete image that could not be decoded: no colour is there

  std::span<const std::byte> pixels() const { return buffer.bytes().subspan(pixel_offset); }
};

using Measurement = std::variant<PpsEdge, TimeLabel, TimedArrival, LaserStatus, InsSolution, InsUncertainty, GnssFix,
                                 ImuSample, EventMark, LaserBatch, Image, WheelSpeed, Fault>;

}  // namespace hueline
