#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "core/time.hpp"

namespace hueline::sync {

/// The relation of two clocks seen only through messages: an event at `x` on one clock arrives at `y` on the other,
/// never before it happened and often much later. The line that touches the earliest arrivals from below (lower convex
/// hull of the smallest delay of each bucket) is the relation plus the smallest delay. Reentrant; bounded memory;
/// deterministic.
class ArrivalLine {
 public:
  struct Config {
    nanoseconds bucket{
        std::chrono::seconds(1)};  ///< one smallest delay is kept for each, on the clock of x; [10 ms, 60 s]
    int buckets = 60;              ///< length of the window; [4, 4096]
    double rate_limit = 1e-4;      ///< largest believable rate difference of the clocks; (0, 0.01]
    nanoseconds jump{
        std::chrono::milliseconds(300)};  ///< a delay this far from the line is not believed at once; >= 1 ms
    int jump_confirmations = 40;          ///< so many in a row are: the line starts anew; >= 2
    std::string validate() const;
  };
  explicit ArrivalLine(Config config) : config_(config) {}

  /// x: event, y: arrival, ns since the epochs of their clocks. False if the pair was refused as a jump.
  bool add(std::int64_t x_ns, std::int64_t y_ns);

  struct Estimate {
    std::int64_t delay_ns = 0;  ///< y - x of an event that arrives as fast as the fastest do
    double sigma_ns = 0;        ///< of that line; what the smallest delay itself is, is not known here
  };
  /// Empty before the first pair.
  std::optional<Estimate> at(std::int64_t x_ns) const;

  /// The other way: the event that, arriving as fast as the fastest do, arrives at y.
  std::optional<std::int64_t> event_of(std::int64_t y_ns) const;

  nanoseconds span() const;                       ///< covered by the window
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
