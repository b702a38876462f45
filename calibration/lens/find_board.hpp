#pragma once

#include "calibration/lens/board.hpp"

namespace hueline::calibration {

/// find_board with a window of one's own around a chessboard's corners. `refine_half_px`: half its edge; 0: a third of
/// the way to the nearest neighbour, at most 11, so that no other corner's edges are in it.
Result<std::vector<SeenCorner>> find_board(const GreyImage& image, const Board& board, int refine_half_px);

}  // namespace hueline::calibration
