#pragma once

#include <cstdint>
#include <vector>

#include "calibration/lens/board.hpp"
#include "fusion/camera_model.hpp"

/// Boards in front of a lens whose values are known. Fusion's camera model projects them; it shares no code with the
/// calibration.
namespace hueline::calibration::test {

struct SimulatedBoards {
  Board board{BoardKind::Chessboard, 9, 7, 0.05, 0, ""};
  int views = 20;
  double noise_px = 0.1;  ///< standard deviation of each pixel coordinate
  double least_tilt_deg = 0,
         /// Tilt of the board from the direction in which it faces the lens, about any axis in the board.
      tilt_deg = 40;
  /// Distances in units of that at which the board's diagonal is as long as the image is wide.
  double nearest = 0.8, farthest = 2.0;
  std::uint32_t seed = 1;
};

/// The views that docs/calibration.md advises for a lens that must be known to a tenth of a pixel: tilted boards that
/// fill half of the image.
SimulatedBoards good_views();

/// Simulates views all over the image. Each corner is inside the image and the field of view.
std::vector<BoardView> simulate_boards(const fusion::CameraIntrinsics& lens, const SimulatedBoards& what);

/// A lens of 1224 x 1024 px, 60 degrees wide, with some barrel distortion.
fusion::CameraIntrinsics plane_lens();
/// The same lens on a sensor with pixels of half the width: 2448 x 2048.
fusion::CameraIntrinsics large_plane_lens();
/// An equidistant lens of 1224 x 1024 px, 2 x 75 degrees, like those of a Ladybug.
fusion::CameraIntrinsics fisheye_lens();

}  // namespace hueline::calibration::test
