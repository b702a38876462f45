#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/laser_time.hpp"

namespace hueline::sync {

/// The instant that a scanner's stamp names: that of an absolute time; of a counter the one nearest to `near`.
/// `utc_offset` is GPS - UTC then. Empty for a counter whose origin is its own: no instant can be told from it.
std::optional<GpsTime> instant_of(const LaserTime& time, GpsTime near, std::chrono::seconds utc_offset);

/// About what time it was at a device that is read from a file, told by nothing but its own labels: enough to know in
/// which of its periods a counter stands. The arrivals carry on from the newest label. A label that names another
/// period than those before is believed when `agreeing` in a row say so; the first ones are held to the same.
/// Reentrant; bounded memory.
class LabelledTime {
 public:
  /// `agreeing`: 1 or more.
  explicit LabelledTime(int agreeing) : agreeing_(agreeing) {}

  /// The device counts periods of this length: labels that are less than half of it apart name the same one. Until this
  /// is said, and for periods of more than an hour: less than half an hour.
  void set_period(nanoseconds period);
  /// The device said at `received` that its latest second was `second`. True if this changed a period that was settled.
  bool add(GpsTime second, HostTime received);
  /// No more labels come before the time is needed: the best supported one has to do.
  void settle();
  bool is_settled() const { return settled_.has_value(); }
  /// About what time it was, to the labels' lateness. Empty until settled.
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
