#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "core/time.hpp"

namespace hueline::sync {

/// The relation of two clocks that is known only from messages. An event at `x` on one clock arrives at `y` on the
/// other; it never arrives before it happened, and often much later. The line that touches the earliest arrivals from
/// below (the lower convex hull of the smallest delay of each bucket) is the relation plus the smallest delay. Memory
/// is bounded; the same input always gives the same result. Thread safety: one thread per object.
class ArrivalLine {
 public:
  struct Config {
    /// One smallest delay is kept for each bucket, on the clock of x; [10 ms, 60 s].
    nanoseconds bucket{std::chrono::seconds(1)};
    int buckets = 60;          ///< length of the window in buckets; [4, 4096]
    double rate_limit = 1e-4;  ///< largest believable difference of the clocks' rates; (0, 0.01]
    /// A delay that differs this much from the line is a jump and is refused; >= 1 ms.
    nanoseconds jump{std::chrono::milliseconds(300)};
    int jump_confirmations = 40;  ///< after this many consecutive jumps the line starts again; >= 2
    std::string validate() const;
  };
  explicit ArrivalLine(Config config) : config_(config) {}

  /// Adds a pair: the event's time `x_ns` and its arrival `y_ns`, in ns since the epochs of their clocks. Returns false
  /// if the pair was refused as a jump.
  bool add(std::int64_t x_ns, std::int64_t y_ns);

  struct Estimate {
    std::int64_t delay_ns = 0;  ///< y - x of an event that arrives as fast as the fastest do
    double sigma_ns = 0;        ///< one sigma of the line; the smallest delay itself is not known here
  };
  /// Returns the delay at `x_ns`. Empty before the first pair.
  std::optional<Estimate> at(std::int64_t x_ns) const;

  /// Returns the time of the event that arrives at `y_ns`, if it arrives as fast as the fastest do.
  std::optional<std::int64_t> event_of(std::int64_t y_ns) const;

  /// Returns the time that the window covers.
  nanoseconds span() const;
  std::uint64_t pairs() const { return pairs_; }  ///< since the last restart
  std::uint64_t restarts() const { return restarts_; }
  void reset();

 private:
  struct Bucket {
    std::int64_t index;
    double x, delay;  // ns, relative to x0_ and delay0_
  };
  void fit();

  Config config_;
  std::deque<Bucket> window_;
  std::int64_t x0_ = 0, delay0_ = 0;
  double line_x_ = 0, line_delay_ = 0, slope_ = 0, scatter_ = 0, slope_sigma_ = 0;
  int jumps_ = 0;
  std::uint64_t pairs_ = 0, restarts_ = 0;
};

}  // namespace hueline::sync
