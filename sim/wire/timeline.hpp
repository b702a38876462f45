#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/drive.hpp"
#include "sim/wire/device_errors.hpp"
#include "sim/wire/little_endian.hpp"
#include "sim/wire/novatel_encode.hpp"
#include "sim/wire/velodyne_encode.hpp"

/// What the devices of the vehicle put on their wires during a drive, and when. "Drive time" is ns after
/// Drive::begin_gps_ns.
namespace hueline::sim {

/// The wire on which an event travels.
enum class WireChannel : std::uint8_t { LaserData, LaserPosition, Pos, Pps, Camera, Wheel };
constexpr std::size_t kWireChannels = 6;
const char* name(WireChannel channel);

/// WireEvent::number of events that are none of the device's units: foreign packets, messages about the bus itself.
constexpr std::uint32_t kNoUnit = UINT32_MAX;

/// One thing that a device sends.
struct WireEvent {
  /// Drive time at which the first byte leaves the device. Pps: at which the kernel reports the edge. Wheel: of the end
  /// of the frame.
  std::int64_t at_ns = 0;
  WireChannel channel = WireChannel::LaserData;
  /// LaserData, LaserPosition: the datagram; Pos: one log; Wheel: a struct can_frame; Pps, Camera: empty.
  Bytes payload;

  /// Pos: what the payload was when it was made; id 0: bytes that belong to no log.
  NovatelPeek log;
  std::uint32_t piece_bytes = 0;  ///< Pos: size of the pieces in which the bytes are sent; 0: all at once

  std::int64_t edge_ns = 0;  ///< Pps: drive time of the edge, including its error
  /// Pps: the source's own count of edges; Camera: the camera's count of exposures, from 0.
  std::uint64_t sequence = 0;
  std::int64_t camera_counter_ns = 0;  ///< Camera: the counter value that was latched for this image
  std::int64_t latched_ns = 0;         ///< Camera: drive time at which it was really latched
  std::uint32_t width = 0, height = 0;
  std::string image_file;             ///< Camera: file of width x height bytes, relative to Timeline::image_folder
  std::uint32_t missing_packets = 0;  ///< Camera: number of its packets that never arrive
  /// Camera: what it reports of the whole image's exposure; 0: nothing.
  std::int64_t reported_exposure_ns = 0;
  float reported_gain = 0;
  std::uint8_t laser = 0;  ///< LaserData, LaserPosition: number of the scanner on the vehicle
  /// LaserData: index of the packet in Drive::laser or Drive::profile; Camera: of the exposure in Drive::exposures;
  /// Wheel: of the sample in Drive::wheel.
  std::uint32_t number = 0;
};

/// Events in the order of `at_ns`. Events of equal time stand in the order of WireChannel, then in the order in which
/// they were made.
struct Timeline {
  GpsNs begin_gps_ns = 0;    ///< drive time 0
  std::int64_t end_ns = 0;   ///< drive time at which the drive ends
  std::string image_folder;  ///< Drive::cache_dir
  std::vector<WireEvent> events;
};

/// A range of latencies. Each latency is drawn evenly from it.
struct Latency {
  std::int64_t least_ns = 0, most_ns = 0;
};

/// What the devices have sent before a drive that is the continuation of another (laps.hpp).
struct SentBefore {
  std::int64_t begin_ns = 0;  ///< drive time at which this drive begins
  std::uint32_t profile_datagrams = 0, exposures = 0, wheel_samples = 0;
};

/// How a drive becomes a Timeline: latencies, clocks and formats of the devices.
struct TimelineConfig {
  std::uint64_t seed = 1;
  LaserModel laser_model = LaserModel::Vlp16;  ///< scanner that Drive::laser is of
  LaserReturnMode laser_return_mode = LaserReturnMode::Strongest;
  /// WireEvent::laser; a profile scanner's datagrams carry the number laser + 1.
  std::uint8_t laser = 0;
  SentBefore before;  ///< drive time and counters go on from there

  Latency laser_data{20'000, 60'000};                   ///< after the packet's last firing
  std::int64_t laser_position_period_ns = 100'000'000;  ///< from one position datagram to the next
  Latency nmea{200'000'000, 400'000'000};               ///< from a second until the scanner has its GPRMC
  Latency ins{3'000'000, 10'000'000};                   ///< INSPVA(S), INSPVAX and INSSTDEV(S) after their time
  Latency bestpos{20'000'000, 60'000'000};              ///< after its second
  Latency time_message{50'000'000, 150'000'000};        ///< TIME after its second
  Latency mark{10'000'000, 30'000'000};                 ///< MARK1TIME and MARK1PVA after the strobe
  Latency pps{5'000, 40'000};                           ///< from an edge until a reader is told of it
  Latency image{25'000'000, 35'000'000};                ///< from the exposure's end to the first packet
  Latency wheel{300'000, 1'500'000};  ///< from the cycle's end to the end of its first frame on the bus

  /// Height of the geoid above the ellipsoid; INSPVAX and BESTPOS carry orthometric heights.
  double undulation_m = 47.0;

  double strobe_jitter_ns = 0;  ///< sigma of the receiver's stamp of a strobe against the exposure's true start

  /// The camera's counter is latched `camera_latch_ns` after the exposure's end, with an even spread of +-
  /// `camera_latch_spread_ns` (a Ladybug5+ in trigger mode has 45 us +- 8 us). It starts at `camera_counter_origin_ns`
  /// and runs too fast by `camera_drift_ppb`.
  std::int64_t camera_latch_ns = 45'000;
  std::int64_t camera_latch_spread_ns = 8'000;
  double camera_drift_ppb = 12'000;
  std::int64_t camera_counter_origin_ns = 1'000'000'000'000;

  /// Returns an empty text if the configuration can be used, else a sentence that names the wrong key.
  std::string validate() const;
};

/// Builds everything that the vehicle's devices send during `drive`. The same drive and configuration give the same
/// bytes and times. Every log of novatel_logs() except RAWIMUSX is in the timeline at the rate of Drive::ins (BESTPOS
/// and TIME once a second); the emulator of the receiver sends those that a client asks for. Errors: Invalid
/// (configuration; a drive that is out of order or incomplete).
Result<Timeline> build_timeline(const Drive& drive, const TimelineConfig& config, const DeviceErrors& errors = {});

/// Sorts events into the order of a timeline. Those that are equal in it keep their order.
void sort_events(std::vector<WireEvent>& events);

/// Adds the events of the scanner of another timeline of the same drive. Its other events are dropped.
void add_laser_of(Timeline& timeline, Timeline other);

}  // namespace hueline::sim
