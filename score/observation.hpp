#pragma once

#include <cstdint>
#include <optional>

#include "score/outlook.hpp"

namespace hueline::score {

/// The colour that a sampled return was given.
struct GivenColour {
  std::uint32_t exposure = 0;
  std::uint8_t lens = 0;
  double difference = 0;  ///< CIEDE2000 difference from the truth
};

/// What rays into the simulated world show about one return.
struct Observation {
  std::uint16_t surface = 0;
  bool has_exposure = false;  ///< false: nothing below is set
  bool is_visible = false;    ///< whether some lens of one of the nine exposures nearest in time sees it
  /// At the nearest exposure no lens has it in its image, or the own vehicle hides it from all lenses that have.
  bool is_in_hole = false;
  bool is_moving = false;  ///< whether its surface moves by itself
  std::optional<GivenColour> given;
  /// Whether the lens that gave the colour has it in its image; false: nothing below is set.
  bool is_in_lens = false;
  Outlook::Met met = Outlook::Met::Place;
  bool meets_moving = false;  ///< whether what that lens met moves by itself
  Outlook::Edges edges;
};

/// Observes one return by rays. Thread-safe; keeps nothing.
Observation observe(const Outlook& outlook, const sim::TrueReturn& truth, const std::optional<GivenColour>& given);

}  // namespace hueline::score
