#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// Decides which gaps in a sequence of datagrams are losses. A datagram that was overtaken on its way fills its gap
/// later; a gap that is still open after `patience` is lost. Without the wait, such a datagram would be counted twice,
/// as lost and as late. The caller chooses what a position is; positions increase.
/// Thread safety: none; one thread calls all functions.
class GapTrial {
 public:
  explicit GapTrial(nanoseconds patience = std::chrono::milliseconds(100)) : patience_(patience) {}

  /// Opens a gap: `missing` datagrams are missing between the positions `before` and `after`. `time` is the arrival of
  /// the datagram that showed it.
  void open(std::int64_t before, std::int64_t after, std::uint64_t missing, HostTime time) {
    gaps_.push_back({before, after, missing, time});
  }
  /// Takes a late datagram into account: the one at `position` has come after all.
  void fill(std::int64_t position) {
    for (Gap& gap : gaps_)
      if (position > gap.before && position < gap.after && gap.missing > 0) {
        --gap.missing;
        return;
      }
  }
  /// A gap that is a loss.
  struct Lost {
    std::uint64_t missing;
    std::int64_t width;  ///< from the datagram before to the one behind
  };
  /// Returns the oldest gap that is lost at the time `now`. Call it again until it returns nothing.
  std::optional<Lost> settled(HostTime now) {
    while (!gaps_.empty() && (now - gaps_.front().seen >= patience_ || now < gaps_.front().seen)) {
      const Gap gap = gaps_.front();
      gaps_.pop_front();
      if (gap.missing > 0) return Lost{gap.missing, gap.after - gap.before};
    }
    return {};
  }
  /// Returns the oldest gap at the end of the data, when no datagram can come any more. Call it again until it returns
  /// nothing.
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
