#pragma once

namespace hueline::sim {

/// Linear light; 1 is a white matt surface that faces the sun.
struct Radiance {
  float r = 0, g = 0, b = 0;
};

}  // namespace hueline::sim
