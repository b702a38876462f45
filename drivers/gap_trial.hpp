#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// Gaps in a row of datagrams, on trial: one that another overtook on its way fills its gap, and what is missing still
/// when so much time has passed that none comes any more is lost. Told as late and as lost, it would be counted twice.
/// Positions are of the caller's choosing and rise. Thread-bound.
class GapTrial {
 public:
  explicit GapTrial(nanoseconds patience = std::chrono::milliseconds(100)) : patience_(patience) {}

  /// Between the datagrams at `before` and `after` so many are missing, as seen on one received at `time`.
  void open(std::int64_t before, std::int64_t after, std::uint64_t missing, HostTime time) {
    gaps_.push_back({before, after, missing, time});
  }
  /// The one at `position` came after all.
  void fill(std::int64_t position) {
    for (Gap& gap : gaps_)
      if (position > gap.before && position < gap.after && gap.missing > 0) {
        --gap.missing;
        return;
      }
  }
  struct Lost {
    std::uint64_t missing;
    std::int64_t width;  ///< from the datagram before to the one behind
  };
  /// The oldest gap that is lost at `now`. Ask until there is none.
  std::optional<Lost> settled(HostTime now) {
    while (!gaps_.empty() && (now - gaps_.front().seen >= patience_ || now < gaps_.front().seen)) {
      const Gap gap = gaps_.front();
      gaps_.pop_front();
      if (gap.missing > 0) return Lost{gap.missing, gap.after - gap.before};
    }
    return {};
  }
  /// No more will come: the oldest gap.
  std::optional<Lost> drain() { return gaps_.empty() ? std::nullopt : settled(gaps_.front().seen + patience_); }

 private:
  struct Gap {
    std::int64_t before, after;
    std::uint64_t missing;
    HostTime seen;
  };
  nanoseconds patience_;
  std::deque<Gap> gaps_;
};

}  // namespace hueline::drivers
