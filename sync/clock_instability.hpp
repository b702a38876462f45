#pragma once

#include <cstdint>
#include <vector>

namespace hueline::sync {

/// What disturbs a clock read against a perfect pulse per second; all measured, none assumed.
struct Instability {
  double jitter_ns2 = 0;         ///< variance of one reading (white phase noise): interrupt latency, edge noise
  double phase_walk = 0;         ///< ns^2/s: white frequency noise
  double frequency_walk = 0;     ///< ns^2/s^3: random walk of the frequency, temperature included
};

/// Measures Instability from the second differences x(t+2m) - 2 x(t+m) + x(t) at lags m = 1 ... 64 s, the same figures an Allan
/// deviation is made of: their variance is 6 J for jitter, 2 m P for a phase walk and (2/3) m^3 F for a frequency walk. A steady
/// drift of temperature raises the long lags and so counts as frequency walk, which keeps the stated sigma on the safe side.
class ClockInstability {
 public:
  /// `window`: readings kept, 128 to 8192; a power of two.
  explicit ClockInstability(int window = 512);

  /// Phase of pulse number `pulse`, ns, relative to any constant and any constant rate. Pulse numbers grow; gaps are fine.
  void add(std::int64_t pulse, double phase_ns);
  void reset();

  /// `prior` is returned as it is below 32 readings.
  Instability estimate(const Instability& prior) const;

 private:
  struct Reading {
    std::int64_t pulse = -1;
    double phase_ns = 0;
  };
  std::vector<Reading> ring_;
  std::int64_t first_ = 0, last_ = -1, count_ = 0;
};

}  // namespace hueline::sync
