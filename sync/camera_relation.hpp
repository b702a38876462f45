#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/time.hpp"

namespace hueline::sync {

/// Converts a camera's counter to the time of the event mark, by a straight line through the newest matched pairs. The
/// scatter around the line is measured. Memory is bounded. Thread safety: one thread per object.
class CameraRelation {
 public:
  struct Config {
    std::size_t pairs = 32;  ///< how many of the newest pairs are kept; [4, 1000]
    /// The scatter is never taken as smaller (resolution of the stamps); > 0.
    nanoseconds clock_sigma{std::chrono::microseconds(5)};
    /// One sigma of the rate of the camera's crystal, before it is measured; (0, 1000].
    double rate_sigma_ppm = 50;
    double wander_ppb = 50;  ///< change of that rate in one second; [0, 1e5]
    std::string validate() const;
  };
  explicit CameraRelation(Config config) : config_(config) {}

  struct Pair {
    std::int64_t counter_ns;
    GpsTime mark;
  };
  void start(const std::vector<Pair>& pairs);
  void add(const Pair& pair);
  void reset() { pairs_.clear(); }
  bool is_known() const { return !pairs_.empty(); }

  struct Prediction {
    GpsTime mark{};
    double sigma_ns = 0;
  };
  /// Returns the time of the mark at a counter reading. Requires is_known().
  Prediction predict(std::int64_t counter_ns) const;

 private:
  void fit();
  Config config_;
  std::deque<Pair> pairs_;
  double mean_x_ = 0, mean_y_ = 0, slope_ = 0, scatter_ = 0,
         // Relative to the first pair: ns, ns, ratio, ns, ns^2.
      spread_ = 0;
};

}  // namespace hueline::sync
