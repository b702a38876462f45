#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/laser_time.hpp"

namespace hueline::sync {

/// Returns the instant that a scanner's stamp names: an absolute time itself, or the instant of a counter reading that
/// is nearest to `near`. `utc_offset` is GPS time minus UTC. Returns nothing for a counter of its own origin, because
/// it names no instant.
std::optional<GpsTime> instant_of(const LaserTime& time, GpsTime near, std::chrono::seconds utc_offset);

/// Estimates the time at a device that is read from a file, from its own labels alone. This is enough to know in which
/// period a counter is. Between labels, the time continues with the arrivals. A label that names another period than
/// the labels before is believed when `agreeing` labels in a row say so; this also holds for the first labels. Memory
/// is bounded. Thread safety: one thread per object.
class LabelledTime {
 public:
  /// `agreeing` is 1 or more.
  explicit LabelledTime(int agreeing) : agreeing_(agreeing) {}

  /// Sets the period of the device's counter. Labels that differ by less than half of it name the same period. Before
  /// this call, and for periods of more than an hour, the limit is half an hour.
  void set_period(nanoseconds period);
  /// Adds a label: at `received`, the device said that its latest second was `second`. Returns true if this changed a
  /// period that was settled.
  bool add(GpsTime second, HostTime received);
  /// Settles with the newest label if nothing is settled yet. Call it if the time is needed and no more labels come.
  void settle();
  bool is_settled() const { return settled_.has_value(); }
  /// Returns the time at `received`, as good as the labels' lateness. Empty until settled.
  std::optional<GpsTime> near(HostTime received) const;

 private:
  struct Candidate {
    GpsTime second;
    HostTime received;
    int in_a_row = 1;
    GpsTime at(HostTime time) const { return second + (time - received); }
  };
  int agreeing_;
  nanoseconds same_ = std::chrono::minutes(30);
  std::optional<Candidate> settled_, challenger_;
};

}  // namespace hueline::sync
