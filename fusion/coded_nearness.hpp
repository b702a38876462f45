#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

/// 1 / distance in two bytes, because maps of directions are larger than caches.
namespace hueline::fusion {

/// A code is the upper bits of a float, from 1/1024 per metre on: 4 bits of the exponent and 12 of the fraction. So
/// codes compare as what they stand for, and err by a four-thousandth at most: a place becomes farther by that. 0
/// stands for nothing within 1024 m.
using CodedNearness = std::uint16_t;

constexpr std::uint32_t kFarthestBits = std::bit_cast<std::uint32_t>(1.0f / 1024);  // the code 0
constexpr int kDroppedBits = 11;

/// Returns the code of a nearness, 1/m. What is nearer than 16 mm gets the code of that.
constexpr CodedNearness coded(float nearness) {
  const auto above = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(nearness) - kFarthestBits);
  return static_cast<CodedNearness>(std::clamp(above >> kDroppedBits, 0, 0xFFFF));
}
/// Returns the nearness, 1/m; 0 if there is nothing.
constexpr float decoded(CodedNearness code) {
  return code == 0 ? 0.0f : std::bit_cast<float>((static_cast<std::uint32_t>(code) << kDroppedBits) + kFarthestBits);
}

}  // namespace hueline::fusion
