#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "score/outlook.hpp"

namespace hueline::score {

/// The colour that a sampled return was given.
struct GivenColour {
  std::uint32_t exposure = 0;
  std::uint8_t lens = 0;
  double difference = 0;  ///< CIEDE2000 difference from the truth
};

/// The exposures from which the colouring could have taken the colour of a return: those that it got with their images
/// and poses, within the window around the firing. A method may use fewer, never others.
class Candidates {
 public:
  /// `mids` are the true middles of all exposures of the drive, in order, and `is_there` says which of them the
  /// colouring got. The window reaches `per_side` and a half median intervals to each side of a firing.
  Candidates(const std::vector<sim::GpsNs>& mids, const std::vector<bool>& is_there, int per_side);
  /// Returns the candidates of a firing, the nearest in time first.
  std::vector<std::uint32_t> of(sim::GpsNs fired) const;

 private:
  std::vector<std::pair<sim::GpsNs, std::uint32_t>> there_;  // middle and number
  sim::GpsNs reach_ = 0;
};

/// What rays into the simulated world show about one return.
struct Observation {
  std::uint16_t surface = 0;
  bool has_exposure = false;  ///< false: nothing below is set
  bool is_visible = false;    ///< whether some lens of one of the nine exposures nearest in time sees it
  /// Whether some lens of a candidate has its place in the image, and not behind the own vehicle.
  bool is_in_candidate = false;
  bool is_seen_by_candidate = false;  ///< whether some lens of a candidate truly sees it
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
Observation observe(const Outlook& outlook, const sim::TrueReturn& truth, const Candidates& candidates,
                    const std::optional<GivenColour>& given);

}  // namespace hueline::score
