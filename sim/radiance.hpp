#pragma once

namespace hueline::sim {

/// Linear light, 1 = a white matt surface facing the sun.
struct Radiance {
  float r = 0, g = 0, b = 0;
};

}  // namespace hueline::sim
