#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/time.hpp"

namespace hueline::sync {

/// Camera counter -> time of the event mark, a straight line through the newest matched pairs with its own measured
/// scatter. Reentrant; bounded memory.
class CameraRelation {
 public:
  struct Config {
    std::size_t pairs = 32;                                 ///< newest pairs kept; [4, 1000]
    nanoseconds clock_sigma{std::chrono::microseconds(5)};  ///< scatter is never believed smaller (resolution); > 0
    double rate_sigma_ppm = 50;  ///< of the camera's crystal, one sigma, before it is measured; (0, 1000]
    double wander_ppb = 50;      ///< change of that rate in a second; [0, 1e5]
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
  /// Call when is_known().
  Prediction predict(std::int64_t counter_ns) const;

 private:
  void fit();
  Config config_;
  std::deque<Pair> pairs_;
  double mean_x_ = 0, mean_y_ = 0, slope_ = 0, scatter_ = 0,
         spread_ = 0;  // relative to the first pair: ns, ns, ratio, ns, ns^2
};

}  // namespace hueline::sync
