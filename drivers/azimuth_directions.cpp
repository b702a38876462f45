#include "drivers/azimuth_directions.hpp"

#include <cstddef>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline::drivers {

const std::array<AzimuthDirection, kAzimuthsOfCircle>& azimuth_directions() {
  static const auto all = [] {
    std::array<AzimuthDirection, kAzimuthsOfCircle> out{};
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / kAzimuthsOfCircle;
      out[i] = {static_cast<float>(portable::sin(angle)), static_cast<float>(portable::cos(angle))};
    }
    return out;
  }();
  return all;
}

}  // namespace hueline::drivers
