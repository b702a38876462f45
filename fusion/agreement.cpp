#include "fusion/agreement.hpp"

namespace hueline::fusion {
namespace {
constexpr float kSameColour = 20.0f;  // images of one surface differ less, in steps of 8 bits
constexpr float kAlone = 0.5f;        // the support of a witness with whom no other agrees
}  // namespace

std::size_t most_agreed(std::span<const Witness> witnesses) {
  std::size_t best = 0;
  float most = -1;
  for (std::size_t i = 0; i < witnesses.size(); ++i) {
    float support = kAlone;
    for (std::size_t k = 0; k < witnesses.size(); ++k) {
      if (k == i) continue;
      float apart2 = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const float apart = static_cast<float>(witnesses[i].colour[c]) - static_cast<float>(witnesses[k].colour[c]);
        apart2 += apart * apart;
      }
      // No exponential function, because libraries differ in its last bit and replays must not.
      const float alike = 1.0f / (1.0f + apart2 / (kSameColour * kSameColour));
      support += witnesses[k].trust * alike * alike;
    }
    if (witnesses[i].own_trust * support <= most) continue;
    most = witnesses[i].own_trust * support;
    best = i;
  }
  return best;
}

}  // namespace hueline::fusion
