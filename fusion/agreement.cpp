#include "fusion/agreement.hpp"

#include <cstddef>

namespace hueline::fusion {
namespace {
constexpr float kSameColour = 20.0f;  // images of one surface differ less, in steps of 8 bits
}  // namespace

void weigh_agreement(std::span<const Witness> witnesses, std::vector<float>& agreement) {
  // Colours one after another, so that compilers make vectors of them.
  thread_local std::array<std::vector<float>, 3> colour;
  thread_local std::vector<float> alike;
  const std::size_t count = witnesses.size();
  for (std::size_t c = 0; c < 3; ++c) {
    colour[c].resize(count);
    for (std::size_t i = 0; i < count; ++i) colour[c][i] = static_cast<float>(witnesses[i].colour[c]);
  }
  alike.resize(count);
  agreement.resize(count);
  const float *red = colour[0].data(), *green = colour[1].data(), *blue = colour[2].data();
  float* const of = alike.data();
  for (std::size_t i = 0; i < count; ++i) {
    const float r = red[i], g = green[i], b = blue[i];
    for (std::size_t k = 0; k < count; ++k) {
      const float apart2 =
          (r - red[k]) * (r - red[k]) + (g - green[k]) * (g - green[k]) + (b - blue[k]) * (b - blue[k]);
      // No exponential function, because libraries differ in its last bit and replays must not.
      const float same = 1.0f / (1.0f + apart2 * (1.0f / (kSameColour * kSameColour)));
      of[k] = same * same;
    }
    float sum = 0;
    for (std::size_t k = 0; k < count; ++k)
      if (k != i) sum += witnesses[k].trust * of[k];
    agreement[i] = sum;
  }
}

}  // namespace hueline::fusion
