#pragma once

#include <cstdint>
#include <optional>

#include "score/outlook.hpp"

namespace hueline::score {

/// How a sampled return was coloured.
struct GivenColour {
  std::uint32_t exposure = 0;
  std::uint8_t lens = 0;
  double difference = 0;  ///< CIEDE2000 against truth
};

/// What rays into the world say of one return.
struct Observation {
  std::uint16_t surface = 0;
  bool has_exposure = false;  ///< without one nothing below is set
  bool is_visible = false;    ///< to some lens of one of the nine exposures nearest in time
  bool is_in_hole = false;  ///< of the nearest exposure: no lens has it in its image, or the own vehicle is in the way
                            ///< of all that have
  bool is_moving = false;   ///< its surface does
  std::optional<GivenColour> given;
  bool is_in_lens = false;  ///< the lens that gave the colour has it in its image; without it nothing below is set
  Outlook::Met met = Outlook::Met::Place;
  bool meets_moving = false;  ///< what that lens met moves by itself
  Outlook::Edges edges;
};

/// Thread-safe: casts rays and keeps nothing.
Observation observe(const Outlook& outlook, const sim::TrueReturn& truth, const std::optional<GivenColour>& given);

}  // namespace hueline::score
