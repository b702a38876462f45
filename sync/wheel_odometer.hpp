#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"
#include "sync/arrival_line.hpp"
#include "sync/fault_log.hpp"
#include "sync/host_clock_model.hpp"

namespace hueline::sync {

/// One wheel encoder. It stamps the encoder's messages in GPS time and compares the counted distance with that of the
/// POS.
///
/// The event that a stamp names is the end of the message's frame on the bus, minus `age`. The kernel stamps this event
/// on the host's clock, late by interrupt and adapter. An adapter with a counter of its own stamps it to a microsecond
/// on that counter. Then the relation of the counter to the host's clock is learnt from the earliest arrivals, which
/// removes the jitter of the messages. Thread safety: one thread per object.
class WheelOdometer {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    /// Mean time from the end of the frame to the kernel's stamp; it is subtracted. [-1 ms, 1 s].
    nanoseconds stamp_delay{0};
    nanoseconds stamp_sigma{std::chrono::microseconds(500)};  ///< one sigma of the stamp; (0, 1 s]
    /// Age of a value when its frame ends: half of the time of which it is the mean. [0, 1 s].
    nanoseconds age{0};
    /// A longer time without a message is reported; [10 ms, 60 s].
    nanoseconds silence{std::chrono::milliseconds(500)};
    nanoseconds window{std::chrono::seconds(2)};  ///< time over which distances are compared; [0.5 s, 60 s]
    /// The distances of a window may differ by this much, plus tolerance_share of the longer one; [0.01, 100].
    double tolerance_m = 0.5;
    double tolerance_share = 0.05;  ///< share of the longer distance; [0, 1]
    ArrivalLine::Config adapter;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit WheelOdometer(Config config);

  /// Stamps a message and appends it to `out`. Call it in order of arrival. Requires clock.can_stamp().
  void add(WheelSpeed wheel, const HostClockModel& clock, std::vector<StampedWheelSpeed>& out);
  /// Adds a solution of the POS, from whose speed along the vehicle its distance is integrated. A solution that is not
  /// good interrupts the distance.
  void add(const InsSolution& solution);
  /// Ends the stream: compares what can still be compared.
  void flush();
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  /// Distances from one kind of value: from integrated speeds, or from counted pulses.
  struct Way {
    double wheels_m = 0;                                               ///< whole distance
    double compared_wheels_m = 0, compared_pos_m = 0, compared_s = 0;  ///< where the POS was good too
    double disagreeing_s = 0;                                          ///< part of compared_s in which they disagree
    std::uint64_t messages = 0;
  };
  const Way& speeds() const { return speeds_.way; }
  const Way& pulses() const { return pulses_.way; }
  SensorId sensor() const { return config_.sensor; }

 private:
  struct Point {
    GpsTime time{};
    double metres = 0;
    std::uint32_t piece = 0;  // part of the POS's distance; nothing is known between two parts
  };
  struct Track {
    const char* name;
    std::optional<Point> last, begin;             // of the current window
    std::deque<std::pair<Point, Point>> windows;  // waiting for the POS
    Way way;
  };

  std::optional<GpsStamp> stamp(const WheelSpeed& wheel, const HostClockModel& clock);
  /// Adds the distance since the last message.
  void extend(Track& track, GpsTime time, double metres);
  /// Adds a distance across a gap; what happened in the gap is not known, so the window starts again.
  void extend_over_gap(Track& track, GpsTime time, double metres);
  void compare(Track& track, bool is_end);
  std::optional<double> pos_way(const Point& from, const Point& to) const;

  Config config_;
  ArrivalLine line_;  // from the adapter's counter to the host's clock
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
