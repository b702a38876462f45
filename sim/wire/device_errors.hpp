#pragma once

#include <cstdint>

#include "sim/drive.hpp"

namespace hueline::sim {

/// The errors that the devices of a vehicle make about the time, applied before anything is encoded. This base class
/// makes no errors. `GpsNs` arguments are true times, or the true whole second that a message labels.
class DeviceErrors {
 public:
  virtual ~DeviceErrors() = default;
  /// Returns the scanner's clock minus UTC, ns.
  virtual std::int64_t scanner_clock_ns(GpsNs) const { return 0; }
  /// Returns what the scanner reports of its PPS: 0 none, 1 synchronising, 2 locked, 3 error.
  virtual std::uint8_t scanner_pps_status(GpsNs) const { return 2; }
  /// Return the errors of the GPRMC of a second: whether it is sent, by how many seconds its label is wrong, and how
  /// much later than usual it arrives.
  virtual bool has_nmea(GpsNs) const { return true; }
  virtual std::int64_t nmea_seconds(GpsNs) const { return 0; }
  virtual std::int64_t nmea_delay_ns(GpsNs) const { return 0; }
  /// Return what is added to the time stamps of the receiver: to all of them, to those of TIME logs, to those of
  /// solutions.
  virtual std::int64_t receiver_clock_ns(GpsNs) const { return 0; }
  virtual std::int64_t time_label_ns(GpsNs) const { return 0; }
  virtual std::int64_t ins_stamp_ns(GpsNs) const { return 0; }
  /// Returns the time status of long headers; 180 is FINESTEERING.
  virtual std::uint8_t receiver_time_status(GpsNs) const { return 180; }
  /// Returns the status of solutions; 3 is INS_SOLUTION_GOOD.
  virtual std::uint32_t ins_status(GpsNs) const { return 3; }
  /// Returns the number of leap seconds inserted since the scenario's beginning.
  virtual int leap_seconds(GpsNs) const { return 0; }
};

}  // namespace hueline::sim
