#pragma once

#include <cstdint>
#include <vector>

#include "calibration/lens/board.hpp"
#include "fusion/camera_model.hpp"

/// Boards before a lens whose values are known. Projected by fusion's camera model, which shares no code with the
/// calibration.
namespace hueline::calibration::test {

struct SimulatedBoards {
  Board board{BoardKind::Chessboard, 9, 7, 0.05, 0, ""};
  int views = 20;
  double noise_px = 0.1;  ///< standard deviation of each pixel coordinate
  double least_tilt_deg = 0,
         tilt_deg = 40;  ///< of the board against the lens's view of it, about any axis in the board
  /// Distances, in those at which the board's diagonal is as long as the image is wide.
  double nearest = 0.8, farthest = 2.0;
  std::uint32_t seed = 1;
};

/// A surveyor's views for a lens that shall be known to a tenth of a pixel: steep boards that fill half of the image
/// (docs/calibration.md).
SimulatedBoards good_views();

/// Views all over the image; each corner inside the image and the field of view.
std::vector<BoardView> simulate_boards(const fusion::CameraIntrinsics& lens, const SimulatedBoards& what);

/// 1224 x 1024, 60 degrees wide, some barrel distortion.
fusion::CameraIntrinsics plane_lens();
/// The same lens on a sensor with pixels of half the width: 2448 x 2048.
fusion::CameraIntrinsics large_plane_lens();
/// 1224 x 1024, equidistant, 2 x 75 degrees: a Ladybug-like lens.
fusion::CameraIntrinsics fisheye_lens();

}  // namespace hueline::calibration::test
