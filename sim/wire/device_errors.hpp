#pragma once

#include <cstdint>

#include "sim/drive.hpp"

namespace hueline::sim {

/// What the devices of a vehicle have wrong about the time, before they encode anything. This one: nothing.
class DeviceErrors {
 public:
  virtual ~DeviceErrors() = default;
  /// The scanner's clock minus UTC, ns.
  virtual std::int64_t scanner_clock_ns(GpsNs) const { return 0; }
  /// What the scanner says of its PPS: 0 none, 1 synchronising, 2 locked, 3 error.
  virtual std::uint8_t scanner_pps_status(GpsNs) const { return 2; }
  /// The GPRMC of a second: none at all, wrong by whole seconds, or later than usual by so much.
  virtual bool has_nmea(GpsNs) const { return true; }
  virtual std::int64_t nmea_seconds(GpsNs) const { return 0; }
  virtual std::int64_t nmea_delay_ns(GpsNs) const { return 0; }
  /// Added to every time stamp that the receiver gives out, to those of TIME, and to those of navigation solutions.
  virtual std::int64_t receiver_clock_ns(GpsNs) const { return 0; }
  virtual std::int64_t time_label_ns(GpsNs) const { return 0; }
  virtual std::int64_t ins_stamp_ns(GpsNs) const { return 0; }
  /// Time status of long headers; 180 is FINESTEERING.
  virtual std::uint8_t receiver_time_status(GpsNs) const { return 180; }
  /// Status of navigation solutions; 3 is INS_SOLUTION_GOOD.
  virtual std::uint32_t ins_status(GpsNs) const { return 3; }
  /// Leap seconds inserted since the scenario's beginning.
  virtual int leap_seconds(GpsNs) const { return 0; }
};

}  // namespace hueline::sim
