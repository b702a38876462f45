#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/lens/lens_adjustment.hpp"

namespace hueline::calibration {

/// Views that are of two lenses, or of one lens whose zoom, focus or stabiliser moved in between.
struct TwoLenses {
  struct One {
    LensValues lens;
    std::vector<std::string> views;  ///< names, in the order of the views
  };
  std::array<One, 2> lenses;

  /// Returns one sentence with both lenses and their views.
  std::string words() const;
};

/// Returns the two lenses if `views`, to which `adjusted` was fitted, are of two. They are parted by the way in which
/// they pull the lens; then each view goes to the lens that fits it better, until none changes. Two lenses always fit
/// better than one. They are taken for real if the gain is many times the disagreement that is left in each of them,
/// and more than a halved set of one lens's views gives. Each must have four views or more.
std::optional<TwoLenses> find_two_lenses(const Board& board, std::span<const BoardView> views,
                                         const AdjustedLens& adjusted, bool one_focal);

}  // namespace hueline::calibration
