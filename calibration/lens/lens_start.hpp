#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/lens/board.hpp"
#include "calibration/lens/lens_values.hpp"

/// Start values of the adjustment, computed from the corners alone; no guess of the lens is needed. All functions are
/// pure.
namespace hueline::calibration {

/// The pose of a board in the lens frame: p_lens = exp(rotation) p_board + translation.
struct BoardPose {
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< axis times angle, rad
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

  /// Returns a point of the board in the lens frame, m.
  Eigen::Vector3d to_lens(const Eigen::Vector3d& p_board) const;
};

/// Returns the homography H with ray ~ H (X, Y, 1) from four corners or more: the eigenvector of the smallest
/// eigenvalue of the cross products' normal matrix (direct linear transformation). `rays` are homogeneous coordinates
/// of the corners, with any scale. Returns nothing if the corners lie on a line.
std::optional<Eigen::Matrix3d> board_homography(std::span<const Eigen::Vector2d> board_m,
                                                std::span<const Eigen::Vector3d> rays);

/// Returns the focal lengths and the principal point of a plane lens without distortion, by Zhang's closed form without
/// skew ("A flexible new technique for camera calibration", PAMI 22(11), 2000, section 3.1). The first two columns of
/// each rotation are orthogonal and of equal length, which gives two equations a view for the image of the absolute
/// conic. Returns nothing with fewer than two views, or if the views do not determine the values (parallel boards).
std::optional<LensValues> zhang_start(const Board& board, std::span<const BoardView> views, std::uint32_t width,
                                      std::uint32_t height);

/// Returns the pose of a board in the lens frame from its homography in rays of the lens, or nothing if the corners do
/// not determine it.
std::optional<BoardPose> board_pose(const Board& board, const BoardView& view, const LensValues& lens);

/// Tries focal lengths over the range that lenses have, with the principal point in the middle and no distortion.
/// Returns the best two by reprojection error, best first. This start also works with strong distortion, because the
/// homography uses rays instead of pixels, and with views that leave Zhang's equations undetermined.
std::vector<LensValues> swept_starts(LensModel model, const Board& board, std::span<const BoardView> views,
                                     std::uint32_t width, std::uint32_t height);

}  // namespace hueline::calibration
