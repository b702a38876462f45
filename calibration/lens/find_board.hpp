#pragma once

#include <vector>

#include "calibration/lens/board.hpp"

namespace hueline::calibration {

/// Finds a board like find_board() of board.hpp, with a chosen refinement window around the corners of a chessboard.
/// `refine_half_px` is half the edge of the window. 0 selects a third of the distance to the nearest neighbour, but at
/// most 11 px, so that the window has no edges of other corners.
Result<std::vector<SeenCorner>> find_board(const GreyImage& image, const Board& board, int refine_half_px);

}  // namespace hueline::calibration
