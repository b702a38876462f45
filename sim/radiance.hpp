#pragma once

namespace hueline::sim {

/// Linear light; 1 is a white matt surface that faces the sun.
struct Radiance {
  float r = 0, g = 0, b = 0;
};
/// Adds this share of the light.
inline void add_light(Radiance& sum, float share, const Radiance& light) {
  sum = {sum.r + share * light.r, sum.g + share * light.g, sum.b + share * light.b};
}

}  // namespace hueline::sim
