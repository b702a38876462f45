#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>

#include "core/angle.hpp"
#include "core/geodesy.hpp"
#include "drivers/stream/message_form.hpp"

/// Fields that several UBX messages have. `at` is the offset in the payload.
namespace hueline::drivers::ubx {

/// Returns an angle in units of 1e-5 degrees, in rad.
inline double angle(std::span<const std::byte> payload, std::size_t at) {
  return static_cast<double>(stream_field<std::int32_t>(payload, at)) * 1e-5 * kRadPerDeg;
}

/// Returns a thousandth: m or m/s.
inline double millis(std::span<const std::byte> payload, std::size_t at) {
  return static_cast<double>(stream_field<std::int32_t>(payload, at)) * 1e-3;
}

inline double accuracy(std::span<const std::byte> payload, std::size_t at, double unit) {
  return static_cast<double>(stream_field<std::uint32_t>(payload, at)) * unit;
}

/// Returns longitude, latitude and ellipsoidal height, which lie one after the other.
inline Geodetic place(std::span<const std::byte> payload, std::size_t at) {
  return {static_cast<double>(stream_field<std::int32_t>(payload, at + 4)) * 1e-7 * kRadPerDeg,
          static_cast<double>(stream_field<std::int32_t>(payload, at)) * 1e-7 * kRadPerDeg, millis(payload, at + 8)};
}

/// Returns the sigmas of each axis for u-blox's accuracy of a position in the plane and upwards.
inline std::array<double, 3> axes(double horizontal, double vertical) {
  return {{horizontal / std::numbers::sqrt2, horizontal / std::numbers::sqrt2, vertical}};
}

}  // namespace hueline::drivers::ubx
