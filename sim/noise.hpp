#pragma once

#include <cstdint>

#include "sim/vec3.hpp"

/// Random numbers by counter: a value depends on (seed, what, which) alone, never on the order of asking or on the
/// number of threads.
namespace hueline::sim {

/// splitmix64's finaliser: every input bit reaches every output bit.
constexpr std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}
constexpr std::uint64_t counter_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return scrambled(scrambled(seed ^ (stream * 0xD1342543DE82EF95ull)) + index);
}
/// [0, 1)
constexpr double uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return static_cast<double>(counter_bits(seed, stream, index) >> 11) * 0x1p-53;
}
/// Normal, sigma 1 (Box-Muller on two uniforms of its own).
inline double gaussian(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  const std::uint64_t a = counter_bits(seed, stream, 2 * index), b = counter_bits(seed, stream, 2 * index + 1);
  const double u = (static_cast<double>(a >> 11) + 1.0) * 0x1p-53;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * static_cast<double>(b >> 11) * 0x1p-53);
}
/// Nearly normal, sigma 1, from 64 random bits: sum of four uniforms (limits +-3.46). For pixels, where speed counts.
constexpr float quick_gaussian(std::uint64_t bits) {
  const auto sum =
      static_cast<std::int32_t>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF) + (bits >> 48));
  return static_cast<float>(sum - 131070) * (1.7320508f / 65536.0f);
}

/// Streams, so that no two uses of randomness share numbers.
enum Stream : std::uint64_t {
  kStreamVibration = 1,
  kStreamRange,
  kStreamDropout,
  kStreamMotor,
  kStreamIns = 16,  ///< .. + 9 slow, + 18 white
  kStreamPps = 40,
  kStreamPpsSpike,
  kStreamStrobe,
  kStreamWheel,
  kStreamPixel = 64,
  kStreamScene = 128,
  kStreamWireLatency = 256,  ///< .. + 7: what draws it
  kStreamInsOutage = 320,    ///< .. + 5 biases, + 11 walks
  kStreamDisk = 384,         ///< which pages survive
  kStreamWireFault = 512,    ///< + number of the rule
  kStreamFaultLine = 4096,   ///< + number of the line in the scenario
};

/// A sequence of uniform draws, for building scenes; the order of drawing is part of the scene.
/// One after the other: never two of them among the arguments of one call, for compilers differ in which comes first.
struct Draw {
  std::uint64_t seed, stream, index = 0;
  double operator()(double lo, double hi) { return lo + (hi - lo) * uniform(seed, stream, index++); }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(counter_bits(seed, stream, index++) % n); }
};

}  // namespace hueline::sim
