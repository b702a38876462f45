#pragma once

#include <array>
#include <cstdint>

#include "sim/scenario_rig.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// Converts linear light to the camera's 8 bits. Light 1 (after the gain) saturates.
class Tone {
 public:
  Tone(ToneCurve curve, double gain);
  std::uint8_t operator()(float linear) const {
    const float x = linear * 65535.0f + 0.5f;
    return table_[x <= 0 ? 0u : (x >= 65535.0f ? 65535u : static_cast<unsigned>(x))];
  }
  float gain() const { return gain_; }
  /// Returns the colour that a perfect camera would deliver.
  std::array<std::uint8_t, 3> perfect(const Radiance& c) const {
    return {(*this)(c.r * gain_), (*this)(c.g * gain_), (*this)(c.b * gain_)};
  }

 private:
  float gain_;
  std::array<std::uint8_t, 65536> table_;
};

}  // namespace hueline::sim
