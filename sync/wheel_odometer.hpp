#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"
#include "sync/arrival_line.hpp"
#include "sync/fault_log.hpp"
#include "sync/host_clock_model.hpp"

namespace hueline::sync {

/// One wheel encoder: its messages in GPS time, and the way that it counts held against that of the POS.
///
/// The event that a stamp names is the end of the message's frame on the bus, less `age`. The kernel stamps it on the
/// host's clock, late by interrupt and adapter; an adapter with a counter of its own stamps it to a microsecond on
/// that: then the relation of the counter to the host's clock is learnt from the earliest arrivals, and the messages'
/// jitter is gone. Reentrant.
class WheelOdometer {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    nanoseconds stamp_delay{
        0};  ///< mean time from the end of the frame to the kernel's stamp, subtracted; [-1 ms, 1 s]
    nanoseconds stamp_sigma{std::chrono::microseconds(500)};  ///< of the stamp; (0, 1 s]
    nanoseconds age{0};  ///< of a value when its frame ends: half of what it is the mean of; [0, 1 s]
    nanoseconds silence{std::chrono::milliseconds(500)};  ///< longer without a message is told; [10 ms, 60 s]
    nanoseconds window{std::chrono::seconds(2)};          ///< over which ways are compared; [0.5 s, 60 s]
    double tolerance_m = 0.5;       ///< ways of a window may differ by so much and ...; [0.01, 100]
    double tolerance_share = 0.05;  ///< ... by this share of the longer one; [0, 1]
    ArrivalLine::Config adapter;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit WheelOdometer(Config config);

  /// In the order of arrival; `clock` can stamp.
  void add(WheelSpeed wheel, const HostClockModel& clock, std::vector<StampedWheelSpeed>& out);
  /// The POS's way: its speed along the vehicle. Solutions that are not good interrupt it.
  void add(const InsSolution& solution);
  /// The end of the stream: what can still be compared.
  void flush();
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  /// Of speeds integrated, or of pulses counted.
  struct Way {
    double wheels_m = 0;                                               ///< all
    double compared_wheels_m = 0, compared_pos_m = 0, compared_s = 0;  ///< where the POS was good as well
    double disagreeing_s = 0;                                          ///< of the compared
    std::uint64_t messages = 0;
  };
  const Way& speeds() const { return speeds_.way; }
  const Way& pulses() const { return pulses_.way; }
  SensorId sensor() const { return config_.sensor; }

 private:
  struct Point {
    GpsTime time{};
    double metres = 0;
    std::uint32_t piece = 0;  // of the POS's way: nothing is known between two pieces
  };
  struct Track {
    const char* name;
    std::optional<Point> last, begin;             // of the running window
    std::deque<std::pair<Point, Point>> windows;  // waiting for the POS
    Way way;
  };

  std::optional<GpsStamp> stamp(const WheelSpeed& wheel, const HostClockModel& clock);
  /// Onward by so much from the last message; the other one: what lies between is not known.
  void go(Track& track, GpsTime time, double metres);
  void leap(Track& track, GpsTime time, double metres);
  void compare(Track& track, bool is_end);
  std::optional<double> pos_way(const Point& from, const Point& to) const;

  Config config_;
  ArrivalLine line_;  // adapter's counter -> host
  Track speeds_{"speeds", {}, {}, {}, {}}, pulses_{"pulses", {}, {}, {}, {}};
  std::optional<double> last_speed_, last_distance_;
  std::optional<GpsTime> last_message_;
  bool is_directional_ = false;
  std::deque<Point> pos_;
  double pos_speed_ = 0;
  std::uint32_t pos_piece_ = 0;
  bool pos_was_good_ = false;
  HostTime newest_{};
  FaultLog faults_;
};

}  // namespace hueline::sync
