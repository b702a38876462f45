#include "calibration/lens/lens_start.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calibration/decompositions.hpp"

namespace hueline::calibration {
namespace {

/// Zhang's v_ij: the row with which h_i^T B h_j is a product with (B11, B22, B13, B23, B33). B12 is 0 without skew.
Eigen::Matrix<double, 5, 1> conic_row(const Eigen::Matrix3d& H, int i, int j) {
  Eigen::Matrix<double, 5, 1> v;
  v << H(0, i) * H(0, j), H(1, i) * H(1, j), H(2, i) * H(0, j) + H(0, i) * H(2, j),
      H(2, i) * H(1, j) + H(1, i) * H(2, j), H(2, i) * H(2, j);
  return v;
}

double reprojection_error2(const Board& board, const BoardView& view, const LensValues& lens, const BoardPose& pose) {
  double sum = 0;
  for (const SeenCorner& corner : view.corners) {
    const auto pixel = lens.project(pose.to_lens(board.corner(corner.index)));
    if (!pixel) return 1e12;
    sum += (*pixel - corner.pixel).squaredNorm();
  }
  return sum;
}

}  // namespace

Eigen::Vector3d BoardPose::to_lens(const Eigen::Vector3d& p_board) const {
  const double angle = rotation.norm();
  const Eigen::AngleAxisd turn(angle, angle > 0 ? Eigen::Vector3d(rotation / angle) : Eigen::Vector3d::UnitX());
  return turn * p_board + translation_m;
}

std::optional<Eigen::Matrix3d> board_homography(std::span<const Eigen::Vector2d> board_m,
                                                std::span<const Eigen::Vector3d> rays) {
  if (board_m.size() < 4 || board_m.size() != rays.size()) return std::nullopt;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : board_m) mean += p;
  mean /= static_cast<double>(board_m.size());
  double spread = 0;
  for (const auto& p : board_m) spread += (p - mean).norm();
  spread /= static_cast<double>(board_m.size());
  if (!(spread > 0)) return std::nullopt;
  Eigen::Matrix3d unit;  // scales board coordinates to size one around zero
  unit << 1 / spread, 0, -mean.x() / spread, 0, 1 / spread, -mean.y() / spread, 0, 0, 1;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d X = unit * Eigen::Vector3d(board_m[i].x(), board_m[i].y(), 1), u = rays[i].normalized();
    Eigen::Matrix3d cross;
    cross << 0, -u.z(), u.y(), u.z(), 0, -u.x(), -u.y(), u.x(), 0;
    Eigen::Matrix<double, 3, 9> A;
    for (int c = 0; c < 3; ++c) A.middleCols<3>(3 * c) = cross * X[c];
    normal += A.transpose() * A;
  }
  const SymmetricEigen eigen = symmetric_eigen(normal);
  if (!(eigen.values[1] > 1e-12 * eigen.values[8]))
    return std::nullopt;  // There is a second solution: the corners lie on a line.
  const Eigen::Matrix3d H = Eigen::Map<const Eigen::Matrix3d>(eigen.vectors.col(0).data());
  return Eigen::Matrix3d(H * unit);
}

std::optional<LensValues> zhang_start(const Board& board, std::span<const BoardView> views, std::uint32_t width,
                                      std::uint32_t height) {
  if (views.size() < 2) return std::nullopt;
  const double scale = 2.0 / (width + height);
  const Eigen::Vector2d middle((width - 1.0) / 2, (height - 1.0) / 2);
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  for (const BoardView& view : views) {
    std::vector<Eigen::Vector2d> places;
    std::vector<Eigen::Vector3d> pixels;
    for (const SeenCorner& corner : view.corners) {
      places.push_back(board.corner(corner.index).head<2>());
      const Eigen::Vector2d pixel = (corner.pixel - middle) * scale;
      pixels.emplace_back(pixel.x(), pixel.y(), 1);
    }
    const auto H = board_homography(places, pixels);
    if (!H) continue;
    const Eigen::Matrix3d h = *H / H->col(0).norm();
    const auto orthogonal = conic_row(h, 0, 1);
    const Eigen::Matrix<double, 5, 1> equal = conic_row(h, 0, 0) - conic_row(h, 1, 1);
    normal += orthogonal * orthogonal.transpose() + equal * equal.transpose();
  }
  const SymmetricEigen eigen = symmetric_eigen(normal);
  if (!(eigen.values[1] > 1e-10 * eigen.values[4])) return std::nullopt;
  Eigen::Matrix<double, 5, 1> b = eigen.vectors.col(0);
  if (b[0] < 0) b = -b;
  if (!(b[0] > 0 && b[1] > 0)) return std::nullopt;
  const double cx = -b[2] / b[0], cy = -b[3] / b[1];
  const double lambda = b[4] - b[2] * b[2] / b[0] - b[3] * b[3] / b[1];
  if (!(lambda > 0)) return std::nullopt;
  LensValues lens;
  lens.model = LensModel::Brown;
  lens.width = width;
  lens.height = height;
  lens.focal_px = Eigen::Vector2d(std::sqrt(lambda / b[0]), std::sqrt(lambda / b[1])) / scale;
  lens.principal_point_px = Eigen::Vector2d(cx, cy) / scale + middle;
  const double size = std::max(width, height);
  const bool plausible = lens.focal_px.minCoeff() > 0.1 * size && lens.focal_px.maxCoeff() < 20 * size &&
                         (lens.principal_point_px - middle).norm() < size;
  if (!plausible) return std::nullopt;
  return lens;
}

std::optional<BoardPose> board_pose(const Board& board, const BoardView& view, const LensValues& lens) {
  std::vector<Eigen::Vector2d> places;
  std::vector<Eigen::Vector3d> rays;
  for (const SeenCorner& corner : view.corners) {
    const auto ray = lens.direction(corner.pixel);
    if (!ray) return std::nullopt;
    places.push_back(board.corner(corner.index).head<2>());
    rays.push_back(*ray);
  }
  auto H = board_homography(places, rays);
  if (!H) return std::nullopt;
  double forward = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    forward += rays[i].dot(*H * Eigen::Vector3d(places[i].x(), places[i].y(), 1));
  const double size = (forward < 0 ? -0.5 : 0.5) * (H->col(0).norm() + H->col(1).norm());
  if (!(std::abs(size) > 0)) return std::nullopt;
  *H /= size;
  Eigen::Matrix3d R;
  R << H->col(0), H->col(1), H->col(0).cross(H->col(1));
  const SingularValues3 parts = singular_values(R);
  R = parts.U * parts.V.transpose();
  if (R.determinant() < 0) return std::nullopt;
  const Eigen::AngleAxisd turn(R);
  return BoardPose{turn.angle() * turn.axis(), H->col(2)};
}

std::vector<LensValues> swept_starts(LensModel model, const Board& board, std::span<const BoardView> views,
                                     std::uint32_t width, std::uint32_t height) {
  constexpr int kSteps = 40, kKept = 2;
  constexpr double kShortest = 0.12, kLongest = 8.0;  // focal length divided by the longer side of the image
  struct Tried {
    double error2;
    LensValues lens;
  };
  std::vector<Tried> tried;
  for (int i = 0; i <= kSteps; ++i) {
    LensValues lens;
    lens.model = model;
    lens.width = width;
    lens.height = height;
    const double f =
        kShortest * std::pow(kLongest / kShortest, static_cast<double>(i) / kSteps) * std::max(width, height);
    lens.focal_px = {f, f};
    lens.principal_point_px = {(width - 1.0) / 2, (height - 1.0) / 2};
    double sum = 0;
    for (const BoardView& view : views) {
      const auto pose = board_pose(board, view, lens);
      // The error of one view is limited, because a lens without distortion may fail in one corner of the image only.
      const double most = 100.0 * static_cast<double>(view.corners.size());
      sum += pose ? std::min(most, reprojection_error2(board, view, lens, *pose)) : most;
    }
    tried.push_back({sum, lens});
  }
  std::stable_sort(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) { return a.error2 < b.error2; });
  std::vector<LensValues> out;
  for (std::size_t i = 0; i < kKept && i < tried.size(); ++i) out.push_back(tried[i].lens);
  return out;
}

}  // namespace hueline::calibration
