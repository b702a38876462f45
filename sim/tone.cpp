#include "sim/tone.hpp"

#include <cmath>

namespace hueline::sim {

Tone::Tone(ToneCurve curve, double gain) : gain_(static_cast<float>(gain)) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    double x = static_cast<double>(i) / 65535.0;
    // IEC 61966-2-1
    if (curve == ToneCurve::Srgb) x = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
    table_[i] = static_cast<std::uint8_t>(std::lround(255 * x));
  }
}

}  // namespace hueline::sim
