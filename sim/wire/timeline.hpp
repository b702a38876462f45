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

/// A drive as it reaches the wires of the vehicle: what, where and when. "Drive time" is ns after Drive::begin_gps_ns.
namespace hueline::sim {

enum class WireChannel : std::uint8_t { LaserData, LaserPosition, Pos, Pps, Camera, Wheel };
constexpr std::size_t kWireChannels = 6;
const char* name(WireChannel channel);

constexpr std::uint32_t kNoUnit =
    UINT32_MAX;  ///< WireEvent::number of what is none of the device's units: foreign packets, words of the bus

/// One thing that a device sends at `at_ns`.
struct WireEvent {
  /// Drive time at which its first byte leaves the device (Pps: at which the kernel would report it; Wheel: of the
  /// frame's end).
  std::int64_t at_ns = 0;
  WireChannel channel = WireChannel::LaserData;
  Bytes
      payload;  ///< LaserData, LaserPosition: the datagram; Pos: one log; Wheel: a struct can_frame; Pps, Camera: empty

  NovatelPeek log;                ///< Pos: what the payload was when it was made; id 0: bytes that belong to no log
  std::uint32_t piece_bytes = 0;  ///< Pos: handed over in pieces of so many bytes; 0: whole

  std::int64_t edge_ns = 0;  ///< Pps: drive time of the edge, its error included
  std::uint64_t sequence =
      0;  ///< Pps: the source's own count of edges; Camera: the camera's count of exposures, from 0
  std::int64_t camera_counter_ns = 0;  ///< Camera: the counter latched for this image
  std::int64_t latched_ns = 0;         ///< Camera: drive time at which it was truly latched
  std::uint32_t width = 0, height = 0;
  std::string image_file;             ///< Camera: width x height bytes; relative to Timeline::image_folder
  std::uint32_t missing_packets = 0;  ///< Camera: so many of its packets never arrive
  std::uint8_t laser = 0;             ///< LaserData, LaserPosition: which of the vehicle's scanners
  /// LaserData: of the packet in Drive::laser or ::profile; Camera: of the exposure in Drive::exposures; Wheel: of the
  /// sample in ::wheel.
  std::uint32_t number = 0;
};

/// Events in the order of `at_ns`; those of one moment in the order of WireChannel, then as they were made.
struct Timeline {
  GpsNs begin_gps_ns = 0;
  std::int64_t duration_ns = 0;
  std::string image_folder;  ///< Drive::cache_dir
  std::vector<WireEvent> events;
};

/// A span from which each latency is drawn, evenly.
struct Latency {
  std::int64_t least_ns = 0, most_ns = 0;
};

struct TimelineConfig {
  std::uint64_t seed = 1;
  LaserModel laser_model = LaserModel::Vlp16;  ///< of Drive::laser
  LaserReturnMode laser_return_mode = LaserReturnMode::Strongest;
  std::uint8_t laser = 0;  ///< WireEvent::laser; a profile scanner gives its datagrams the number laser + 1

  Latency laser_data{20'000, 60'000};                   ///< after the packet's last firing
  std::int64_t laser_position_period_ns = 100'000'000;  ///< between position datagrams
  Latency nmea{200'000'000, 400'000'000};               ///< the scanner has the GPRMC this long after its second
  Latency ins{3'000'000, 10'000'000};                   ///< INSPVA(S), INSPVAX, INSSTDEV(S) after their instant
  Latency bestpos{20'000'000, 60'000'000};              ///< after its second
  Latency time_message{50'000'000, 150'000'000};        ///< TIME after its second
  Latency mark{10'000'000, 30'000'000};                 ///< MARK1TIME and MARK1PVA after the strobe
  Latency pps{5'000, 40'000};                           ///< from an edge until a reader hears of it
  Latency image{25'000'000, 35'000'000};                ///< from the exposure's end to the first packet
  Latency wheel{300'000, 1'500'000};  ///< from the cycle's end to the end of its first frame on the bus

  double undulation_m = 47.0;  ///< geoid above ellipsoid: INSPVAX and BESTPOS carry heights above the geoid

  double strobe_jitter_ns = 0;  ///< sigma of the receiver's stamp of a strobe against the exposure's true start

  /// The camera's counter: latched at the exposure's end plus `camera_latch_ns`, evenly spread by +-
  /// `camera_latch_spread_ns` (a Ladybug5+ in trigger mode: 45 us +- 8 us); runs `camera_drift_ppb` too fast from
  /// `camera_counter_origin_ns` on.
  std::int64_t camera_latch_ns = 45'000;
  std::int64_t camera_latch_spread_ns = 8'000;
  double camera_drift_ppb = 12'000;
  std::int64_t camera_counter_origin_ns = 1'000'000'000'000;

  /// Empty if usable, else a sentence that names the key.
  std::string validate() const;
};

/// All that the vehicle's devices send during `drive`. The same drive and config give the same bytes and times. Every
/// log of novatel_logs() but RAWIMUSX is offered at the rate of Drive::ins (BESTPOS and TIME once a second); the
/// receiver's emulator sends those it is asked for. Invalid: config, unordered or incomplete drive.
Result<Timeline> build_timeline(const Drive& drive, const TimelineConfig& config, const DeviceErrors& errors = {});

/// Adds what the scanner of another timeline of the same drive sends; its other events are not taken.
void add_laser_of(Timeline& timeline, Timeline other);

}  // namespace hueline::sim
