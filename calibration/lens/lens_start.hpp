#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/lens/board.hpp"
#include "calibration/lens/lens_values.hpp"

/// Values to begin the adjustment with, from the corners alone: no guess of the lens is needed. Pure functions.
namespace hueline::calibration {

/// Where a board stands: p_lens = exp(rotation) p_board + translation.
struct BoardPose {
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< axis times angle, rad
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
};

/// The homography H with ray ~ H (X, Y, 1), from four corners or more: the least eigenvector of the cross products'
/// normal matrix (direct linear transformation). `rays`: any homogeneous coordinates of the corners. Empty if the
/// corners lie on a line.
std::optional<Eigen::Matrix3d> board_homography(std::span<const Eigen::Vector2d> board_m,
                                                std::span<const Eigen::Vector3d> rays);

/// Zhang's closed form without skew ("A flexible new technique for camera calibration", PAMI 22(11), 2000,
/// section 3.1): the two columns of each rotation are orthogonal and equally long, two equations a view for the image
/// of the absolute conic. Focal lengths and principal point of a plane lens without distortion. Empty with fewer than
/// two views, or where the views do not fix it (parallel boards).
std::optional<LensValues> zhang_start(const Board& board, std::span<const BoardView> views, std::uint32_t width,
                                      std::uint32_t height);

/// Pose of a board before a lens, from its homography in rays of the lens. Empty where the corners do not fix it.
std::optional<BoardPose> board_pose(const Board& board, const BoardView& view, const LensValues& lens);

/// Focal lengths swept over what lenses have, principal point in the middle, no distortion: those whose poses reproject
/// the corners best, best first. Serves strong distortion (rays instead of pixels in the homography) and views that
/// Zhang's equations leave open.
std::vector<LensValues> swept_starts(LensModel model, const Board& board, std::span<const BoardView> views,
                                     std::uint32_t width, std::uint32_t height);

}  // namespace hueline::calibration
