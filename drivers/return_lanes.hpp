#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "core/measurements.hpp"

/// How the kernels of scanners write their returns: first each quantity of many firings into an array of its own, in
/// loops that vectorise, then four returns at a time from there into their structures.
namespace hueline::drivers {

/// The quantities of up to N returns. N is a multiple of 4.
template <std::size_t N>
struct ReturnLanes {
  static_assert(N % 4 == 0);
  alignas(16) std::array<float, N> x, y, z, range, azimuth;
  alignas(16) std::array<std::int32_t, N> time_ns;
  /// Channel, reflectivity and return number, as they lie in LaserReturn (tags_of()).
  alignas(16) std::array<std::uint32_t, N> tags;
  alignas(16) std::array<std::uint32_t, N> return_count;
  alignas(16) std::array<std::uint32_t, N> keep;  ///< 1: the return is written, 0: it is not
};

/// Returns the four bytes of LaserReturn that begin at `channel`.
constexpr std::uint32_t tags_of(std::uint32_t channel, std::uint32_t reflectivity, std::uint32_t return_number) {
  return channel | reflectivity << 16U | return_number << 24U;
}

/// Returns an angle of [-2 pi, 4 pi) within [0, 2 pi), rad. Terms that are added or not are masked, because GCC makes
/// branches of conditional sums, and no vectors of a loop with branches.
inline float in_circle(float angle) {
  constexpr auto kTurn = static_cast<float>(2 * std::numbers::pi);
  constexpr auto kBits = std::bit_cast<std::int32_t>(kTurn);
  const float from_0 = angle + std::bit_cast<float>(kBits & -static_cast<std::int32_t>(angle < 0.0f));
  return from_0 - std::bit_cast<float>(kBits & -static_cast<std::int32_t>(from_0 >= kTurn));
}

namespace detail {

// Four lanes; both compilers make instructions of any processor from them.
using Floats = float __attribute__((vector_size(16)));
using Words = std::int32_t __attribute__((vector_size(16)));
static_assert(offsetof(LaserReturn, x) == 0 && offsetof(LaserReturn, y) == 4 && offsetof(LaserReturn, z) == 8 &&
              offsetof(LaserReturn, range_m) == 12 && offsetof(LaserReturn, azimuth) == 16 &&
              offsetof(LaserReturn, time_offset_ns) == 20 && offsetof(LaserReturn, channel) == 24 &&
              offsetof(LaserReturn, reflectivity) == 26 && offsetof(LaserReturn, return_number) == 27 &&
              offsetof(LaserReturn, return_count) == 28);

template <class To, class From>
inline To load4(const From* from) {
  To out;
  std::memcpy(&out, from, sizeof out);
  return out;
}

/// The halves of four structures.
struct FourReturns {
  Floats place[4];  ///< x y z range
  Words rest[4];    ///< azimuth time tags count

  template <std::size_t N>
  FourReturns(const ReturnLanes<N>& lanes, std::size_t i) {
    const auto x = load4<Floats>(&lanes.x[i]), y = load4<Floats>(&lanes.y[i]), z = load4<Floats>(&lanes.z[i]),
               r = load4<Floats>(&lanes.range[i]);
    const Floats xy_low = __builtin_shufflevector(x, y, 0, 4, 1, 5),
                 xy_high = __builtin_shufflevector(x, y, 2, 6, 3, 7);
    const Floats zr_low = __builtin_shufflevector(z, r, 0, 4, 1, 5),
                 zr_high = __builtin_shufflevector(z, r, 2, 6, 3, 7);
    place[0] = __builtin_shufflevector(xy_low, zr_low, 0, 1, 4, 5);
    place[1] = __builtin_shufflevector(xy_low, zr_low, 2, 3, 6, 7);
    place[2] = __builtin_shufflevector(xy_high, zr_high, 0, 1, 4, 5);
    place[3] = __builtin_shufflevector(xy_high, zr_high, 2, 3, 6, 7);
    const auto a = load4<Words>(&lanes.azimuth[i]), t = load4<Words>(&lanes.time_ns[i]),
               g = load4<Words>(&lanes.tags[i]), c = load4<Words>(&lanes.return_count[i]);
    const Words at_low = __builtin_shufflevector(a, t, 0, 4, 1, 5), at_high = __builtin_shufflevector(a, t, 2, 6, 3, 7);
    const Words gc_low = __builtin_shufflevector(g, c, 0, 4, 1, 5), gc_high = __builtin_shufflevector(g, c, 2, 6, 3, 7);
    rest[0] = __builtin_shufflevector(at_low, gc_low, 0, 1, 4, 5);
    rest[1] = __builtin_shufflevector(at_low, gc_low, 2, 3, 6, 7);
    rest[2] = __builtin_shufflevector(at_high, gc_high, 0, 1, 4, 5);
    rest[3] = __builtin_shufflevector(at_high, gc_high, 2, 3, 6, 7);
  }
  void write(std::size_t k, LaserReturn* out) const {
    auto* bytes = reinterpret_cast<std::byte*>(out);
    std::memcpy(bytes, &place[k], 16);
    std::memcpy(bytes + 16, &rest[k], 16);
  }
};

}  // namespace detail

/// Writes those of the first `count` lanes that are kept to `out`, and returns the end. There must be room for one more
/// return than is kept, because a return is written before it is known whether it is kept: whether it is, is nearly
/// random, and a wrong branch prediction costs more than the store. `count` is a multiple of 4.
template <std::size_t N>
inline LaserReturn* write_returns(const ReturnLanes<N>& lanes, std::size_t count, LaserReturn* out) {
  for (std::size_t i = 0; i < count; i += 4) {
    const detail::FourReturns four(lanes, i);
    for (std::size_t k = 0; k < 4; ++k) {
      four.write(k, out);
      out += lanes.keep[i + k];
    }
  }
  return out;
}

/// The same for firings with up to two returns: of each firing first the one of `near`, then the one of `far`.
template <std::size_t N>
inline LaserReturn* write_returns(const ReturnLanes<N>& near, const ReturnLanes<N>& far, std::size_t count,
                                  LaserReturn* out) {
  for (std::size_t i = 0; i < count; i += 4) {
    const detail::FourReturns first(near, i), second(far, i);
    for (std::size_t k = 0; k < 4; ++k) {
      first.write(k, out);
      out += near.keep[i + k];
      second.write(k, out);
      out += far.keep[i + k];
    }
  }
  return out;
}

}  // namespace hueline::drivers
