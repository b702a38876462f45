#pragma once

#include <cstdint>

#include "sim/vec3.hpp"

/// Counter-based random numbers. A value depends on seed, stream and index alone, never on the order of the calls or on
/// the number of threads.
namespace hueline::sim {

/// Mixes the bits of `x` with the finaliser of splitmix64: every bit of the input affects every bit of the output.
constexpr std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}
/// Returns 64 random bits.
constexpr std::uint64_t counter_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return scrambled(scrambled(seed ^ (stream * 0xD1342543DE82EF95ull)) + index);
}
/// Returns a number in [0, 1).
constexpr double uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return static_cast<double>(counter_bits(seed, stream, index) >> 11) * 0x1p-53;
}
/// Returns a normal number of sigma 1, by Box-Muller from two uniform numbers of its own.
inline double gaussian(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  const std::uint64_t a = counter_bits(seed, stream, 2 * index), b = counter_bits(seed, stream, 2 * index + 1);
  const double u = (static_cast<double>(a >> 11) + 1.0) * 0x1p-53;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * static_cast<double>(b >> 11) * 0x1p-53);
}
/// Returns a nearly normal number of sigma 1 from 64 random bits: the sum of four uniform numbers, within +-3.46. Used
/// for pixels, where speed counts.
constexpr float quick_gaussian(std::uint64_t bits) {
  const auto sum =
      static_cast<std::int32_t>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF) + (bits >> 48));
  return static_cast<float>(sum - 131070) * (1.7320508f / 65536.0f);
}

/// What a random number is for. No two purposes share numbers. A stream that needs several numbers takes those after
/// it.
enum Stream : std::uint64_t {
  kStreamVibration = 1,
  kStreamRange,
  kStreamDropout,
  kStreamMotor,
  kStreamIns = 16,  ///< also + 0 .. 8 for the slow errors and + 9 .. 17 for the white ones
  kStreamPps = 40,
  kStreamPpsSpike,
  kStreamStrobe,
  kStreamWheel,
  kStreamPixel = 64,
  kStreamScene = 128,
  kStreamWireLatency = 256,  ///< also + 1 .. 7, by what is delayed
  kStreamInsOutage = 320,    ///< also + 0 .. 5 for the biases and + 6 .. 11 for the random walks
  kStreamDisk = 384,         ///< which pages survive a loss of power
  kStreamWireFault = 512,    ///< plus the number of the rule
  kStreamFaultLine = 4096,   ///< plus the number of the line in the scenario
};

/// A sequence of uniform numbers for building scenes; the order of the draws is a part of the scene. Never write two
/// draws among the arguments of one call, because compilers evaluate arguments in different orders.
struct Draw {
  std::uint64_t seed, stream, index = 0;
  /// Returns a number in [lo, hi).
  double operator()(double lo, double hi) { return lo + (hi - lo) * uniform(seed, stream, index++); }
  /// Returns a whole number in 0 .. n - 1.
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(counter_bits(seed, stream, index++) % n); }
};

}  // namespace hueline::sim
