#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// How far several images show the same where a point would be, when the laser points leave it open which of them see
/// it.
namespace hueline::fusion {

/// What an image shows where a point would be.
struct Witness {
  std::array<std::uint8_t, 3> colour{};  ///< as rendered, so that images of different gains can be compared
  float trust = 0;                       ///< how far it is believed to show the point, 0 to 1
};

/// Sets for each witness how far the others agree with it (docs/methods/visibility.md, equation 34): images that show
/// the point show one colour, the others show whatever happens to be in front of it. Each agreement is the sum of the
/// trusts of others that show the same colour.
void weigh_agreement(std::span<const Witness> witnesses, std::vector<float>& agreement);

}  // namespace hueline::fusion
