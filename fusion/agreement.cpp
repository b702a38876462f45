#include "fusion/agreement.hpp"

#include <array>
#include <vector>

namespace hueline::fusion {
namespace {
constexpr float kSameColour = 20.0f;  // images of one surface differ less, in steps of 8 bits
constexpr float kAlone = 0.5f;        // the support of a witness with whom no other agrees
}  // namespace

std::size_t most_agreed(std::span<const Witness> witnesses) {
  // Colours one after another, so that compilers make vectors of them.
  thread_local std::array<std::vector<float>, 3> colour;
  thread_local std::vector<float> supports;
  const std::size_t count = witnesses.size();
  for (std::size_t c = 0; c < 3; ++c) {
    colour[c].resize(count);
    for (std::size_t i = 0; i < count; ++i) colour[c][i] = static_cast<float>(witnesses[i].colour[c]);
  }
  supports.resize(count);
  const float *red = colour[0].data(), *green = colour[1].data(), *blue = colour[2].data();
  float* const of = supports.data();
  std::size_t best = 0;
  float most = -1;
  for (std::size_t i = 0; i < count; ++i) {
    const float r = red[i], g = green[i], b = blue[i];
    for (std::size_t k = 0; k < count; ++k) {
      const float apart2 =
          (r - red[k]) * (r - red[k]) + (g - green[k]) * (g - green[k]) + (b - blue[k]) * (b - blue[k]);
      // No exponential function, because libraries differ in its last bit and replays must not.
      const float alike = 1.0f / (1.0f + apart2 * (1.0f / (kSameColour * kSameColour)));
      of[k] = alike * alike;
    }
    float support = kAlone;
    for (std::size_t k = 0; k < count; ++k)
      if (k != i) support += witnesses[k].trust * of[k];
    if (witnesses[i].own_trust * support <= most) continue;
    most = witnesses[i].own_trust * support;
    best = i;
  }
  return best;
}

}  // namespace hueline::fusion
