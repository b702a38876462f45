#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/time.hpp"

namespace hueline::sync {

/// The instant nearest to `near` at which a counter past the UTC hour stands at `counter`. `utc_offset`: GPS - UTC then.
GpsTime instant_of(DeviceTime<UtcHourCounter> counter, GpsTime near, std::chrono::seconds utc_offset);

/// Date and hour of a device that counts within the UTC hour, told by nothing but its own receiver's labels. The arrivals carry
/// on from the newest label, so the hour is right as long as they are not half an hour off. A label whose hour is another
/// one than those before is believed when `agreeing` in a row say so; the first are held to the same. Reentrant; bounded memory.
class HourLabel {
 public:
  /// `agreeing`: 1 or more.
  explicit HourLabel(int agreeing) : agreeing_(agreeing) {}

  /// The device said at `received` that its latest second was `second`. True if this changed an hour that was settled.
  bool add(GpsTime second, HostTime received);
  /// No more labels come before an hour is needed: the best supported one has to do.
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
  std::optional<Candidate> settled_, challenger_;
};

}  // namespace hueline::sync
