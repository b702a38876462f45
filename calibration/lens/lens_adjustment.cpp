#include "calibration/lens/lens_adjustment.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "calibration/decompositions.hpp"

namespace hueline::calibration {
namespace {

/// Residual of one corner, seen minus projected pixel. Its parameters are those of the lens, the pose of the board and,
/// if it is adjusted, the bend of the board.
struct CornerResidual {
  LensModel model;
  bool one_focal;
  Eigen::Vector3d p_board;
  Eigen::Vector2d pixel;
  std::array<double, kBendTerms> bend_terms{};

  template <class T>
  bool operator()(const T* lens, const T* pose, T* residual) const {
    const T place[3] = {T(p_board.x()), T(p_board.y()), T(p_board.z())};
    return at_place(lens, pose, place, residual);
  }
  template <class T>
  bool operator()(const T* lens, const T* pose, const T* bend, T* residual) const {
    T place[3] = {T(p_board.x()), T(p_board.y()), T(0.0)};
    for (std::size_t i = 0; i < kBendTerms; ++i) place[2] += bend[i] * bend_terms[i];
    return at_place(lens, pose, place, residual);
  }

 private:
  template <class T>
  bool at_place(const T* lens, const T* pose, const T* place, T* residual) const {
    T p_lens[3];
    ceres::AngleAxisRotatePoint(pose, place, p_lens);
    for (int i = 0; i < 3; ++i) p_lens[i] += pose[3 + i];
    T values[kLensParameters];
    std::copy(lens, lens + kLensParameters, values);
    if (one_focal) values[1] = values[0];
    T projected[2];
    if (!project_with(model, values, p_lens, projected)) return false;
    residual[0] = pixel.x() - projected[0];
    residual[1] = pixel.y() - projected[1];
    return true;
  }
};
using CornerCost = ceres::AutoDiffCostFunction<CornerResidual, 2, kLensParameters, 6>;
using BentCornerCost = ceres::AutoDiffCostFunction<CornerResidual, 2, kLensParameters, 6, kBendTerms>;

/// What is the same in all views: the lens, and the bend of the board behind it.
using Common = std::array<double, kLensParameters + kBendTerms>;

ceres::CostFunction* corner_cost(const Board& board, const SeenCorner& corner, LensModel model, bool one_focal) {
  return new CornerCost(new CornerResidual{model, one_focal, board.corner(corner.index), corner.pixel});
}

ceres::CostFunction* bent_corner_cost(const Board& board, const SeenCorner& corner, LensModel model, bool one_focal) {
  return new BentCornerCost(
      new CornerResidual{model, one_focal, board.corner(corner.index), corner.pixel, board.bend_terms(corner.index)});
}

using Pose = std::array<double, 6>;
Pose numbers_of(const BoardPose& p) {
  return {p.rotation.x(),      p.rotation.y(),      p.rotation.z(),
          p.translation_m.x(), p.translation_m.y(), p.translation_m.z()};
}
BoardPose pose_of(const Pose& p) { return {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}}; }

/// Returns which parameters of a lens are not adjusted.
std::vector<int> fixed_parameters(LensModel model, bool one_focal) {
  std::vector<int> out;
  if (one_focal) out.push_back(1);
  if (model == LensModel::KannalaBrandt) out.push_back(kLensParameters - 1);
  return out;
}

/// Returns whether each corner of the view has a pixel with this lens and pose. A solver that starts without them gives
/// up, with messages of its own on the error output.
bool has_pixels(const Board& board, const BoardView& view, const LensValues& lens, const Pose& pose) {
  const auto values = lens.parameters();
  return std::ranges::all_of(view.corners, [&](const SeenCorner& corner) {
    Eigen::Vector2d residual;
    return CornerResidual{lens.model, false, board.corner(corner.index), corner.pixel}(values.data(), pose.data(),
                                                                                       residual.data());
  });
}

/// What one view says about the common parameters, after its pose is eliminated (Schur complement).
struct ViewNormal {
  Eigen::MatrixXd matrix;    ///< its part of the normal matrix
  Eigen::VectorXd gradient;  ///< its part of the gradient, whose sum over the views is 0 at the optimum
};

/// Returns what the view of `pose` says about the `free` ones of the common parameters, or nothing if its corners do
/// not determine the pose.
std::optional<ViewNormal> view_normal(ceres::Problem& problem, const Common& common, Pose& pose,
                                      const std::vector<int>& free) {
  constexpr int n = kLensParameters + static_cast<int>(kBendTerms);
  Eigen::Matrix<double, n, n> U = Eigen::Matrix<double, n, n>::Zero();
  Eigen::Matrix<double, n, 6> W = Eigen::Matrix<double, n, 6>::Zero();
  Eigen::Matrix<double, 6, 6> V = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, n, 1> a = Eigen::Matrix<double, n, 1>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  std::vector<ceres::ResidualBlockId> blocks;
  problem.GetResidualBlocksForParameterBlock(pose.data(), &blocks);
  for (const auto block : blocks) {
    Eigen::Vector2d residual;
    Eigen::Matrix<double, 2, kLensParameters, Eigen::RowMajor> of_lens;
    Eigen::Matrix<double, 2, static_cast<int>(kBendTerms), Eigen::RowMajor> of_bend;
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> B;
    of_bend.setZero();  // a plane board has no such parameters
    const double* parameters[3] = {common.data(), pose.data(), common.data() + kLensParameters};
    double* jacobians[3] = {of_lens.data(), B.data(), of_bend.data()};
    if (!problem.GetCostFunctionForResidualBlock(block)->Evaluate(parameters, residual.data(), jacobians))
      return std::nullopt;
    Eigen::Matrix<double, 2, n> A;
    A << of_lens, of_bend;
    U += A.transpose() * A;
    W += A.transpose() * B;
    V += B.transpose() * B;
    a += A.transpose() * residual;
    b += B.transpose() * residual;
  }
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(V);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Eigen::Matrix<double, n, n> matrix = U - W * solver.solve(W.transpose());
  const Eigen::Matrix<double, n, 1> gradient = a - W * solver.solve(b);
  return ViewNormal{matrix(free, free), gradient(free)};
}

/// Computes covariance, disagreement and pulls of an AdjustedLens. Returns false if the views do not determine
/// the lens.
///
/// The inverse normal matrix alone takes the errors of all corners for independent. Those of one view are not: the
/// board is not quite plane, the light moves its edges, and the model does not describe the lens exactly. How far the
/// views pull the lens in different directions shows what such errors do to it (the sandwich estimator with a cluster
/// for each view, corrected for the leverage of the view: Bell and McCaffrey 2002, "CR2").
bool lens_covariance(ceres::Problem& problem, const Common& common, std::vector<Pose>& poses,
                     const std::vector<int>& fixed, bool is_bent, AdjustedLens& out) {
  std::vector<int> free;
  for (int i = 0; i < kLensParameters; ++i)
    if (std::find(fixed.begin(), fixed.end(), i) == fixed.end()) free.push_back(i);
  const auto of_lens = static_cast<Eigen::Index>(free.size());
  for (int i = 0; is_bent && i < static_cast<int>(kBendTerms); ++i) free.push_back(kLensParameters + i);
  const auto m = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(m, m);
  std::vector<ViewNormal> views;
  for (Pose& pose : poses) {
    auto view = view_normal(problem, common, pose, free);
    if (!view) return false;
    normal += view->matrix;
    views.push_back(std::move(*view));
  }
  // A unit diagonal is needed because focal lengths and k3 differ by ten powers of ten.
  const Eigen::VectorXd unit = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(unit.asDiagonal() * normal * unit.asDiagonal());
  if (!(eigen.values[0] > 1e-13)) return false;
  // In these parameters the normal matrix is the identity.
  const Eigen::MatrixXd whiten =
      eigen.values.cwiseSqrt().cwiseInverse().asDiagonal() * eigen.vectors.transpose() * unit.asDiagonal();
  Eigen::MatrixXd pulls(m, static_cast<Eigen::Index>(views.size()));
  for (std::size_t v = 0; v < views.size(); ++v) {
    const SymmetricEigen leverage = symmetric_eigen(whiten * views[v].matrix * whiten.transpose());
    const Eigen::VectorXd rest = (1 - leverage.values.array()).cwiseMax(1e-6).sqrt().inverse();
    pulls.col(static_cast<Eigen::Index>(v)) =
        leverage.vectors * rest.asDiagonal() * leverage.vectors.transpose() * whiten * views[v].gradient;
  }
  // Views without any noise agree but for rounding errors.
  const double sigma2 = std::max(out.sigma_px * out.sigma_px, 1e-16);
  const Eigen::MatrixXd spread = pulls * pulls.transpose() / sigma2;
  out.disagreement = std::sqrt(spread.trace() / static_cast<double>(m));
  const SymmetricEigen directions = symmetric_eigen(spread);
  const Eigen::VectorXd along = directions.vectors.col(m - 1).transpose() * pulls;
  out.pulls.assign(along.data(), along.data() + along.size());
  // Few views may agree by chance. No direction is therefore taken for better known than by the noise of the corners.
  const Eigen::MatrixXd back = whiten.transpose() * directions.vectors;
  const Eigen::MatrixXd covariance =
      out.sigma_px * out.sigma_px * back * directions.values.cwiseMax(1.0).asDiagonal() * back.transpose();
  out.covariance.setZero();
  for (Eigen::Index i = 0; i < of_lens; ++i)
    if (const int parameter = free[static_cast<std::size_t>(i)]; parameter < 2)
      out.focal_noise_px[parameter] = out.sigma_px * whiten.col(i).norm();
  for (Eigen::Index i = 0; i < of_lens; ++i)
    for (Eigen::Index j = 0; j < of_lens; ++j)
      out.covariance(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]) = covariance(i, j);
  return true;
}

/// Adds the lens as a parameter block, with `fixed` held, the bend of the board if it is adjusted, and a residual block
/// for each corner.
void add_corners(const Board& board, std::span<const BoardView> views, LensModel model,
                 const LensAdjustmentConfig& config, const std::vector<int>& fixed, Common& common,
                 std::vector<Pose>& poses, ceres::Problem& problem) {
  double* lens = common.data();
  problem.AddParameterBlock(lens, kLensParameters);
  if (!fixed.empty()) problem.SetManifold(lens, new ceres::SubsetManifold(kLensParameters, fixed));
  problem.SetParameterLowerBound(lens, 0, 1.0);
  problem.SetParameterLowerBound(lens, 1, 1.0);
  for (std::size_t v = 0; v < views.size(); ++v)
    for (const SeenCorner& corner : views[v].corners) {
      ceres::LossFunction* loss = config.robust_px > 0 ? new ceres::CauchyLoss(config.robust_px) : nullptr;
      if (config.is_bent)
        problem.AddResidualBlock(bent_corner_cost(board, corner, model, config.one_focal), loss, lens, poses[v].data(),
                                 lens + kLensParameters);
      else
        problem.AddResidualBlock(corner_cost(board, corner, model, config.one_focal), loss, lens, poses[v].data());
    }
}

/// Minimises the residuals and returns the final cost. Error: Unavailable if the minimisation does not converge.
Result<double> solve(const LensAdjustmentConfig& config, Common& common, std::vector<Pose>& poses,
                     ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Pose& pose : poses) options.linear_solver_ordering->AddElementToGroup(pose.data(), 0);
  options.linear_solver_ordering->AddElementToGroup(common.data(), 1);
  if (config.is_bent) options.linear_solver_ordering->AddElementToGroup(common.data() + kLensParameters, 1);
  options.max_num_iterations = config.max_iterations;
  // A robust fit may stop early, because a least-squares fit follows it.
  const bool is_first = config.robust_px > 0;
  options.function_tolerance = is_first ? 1e-7 : 1e-12;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = is_first ? 1e-8 : 1e-11;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable())
    return Error{ErrorCode::Unavailable, "the adjustment does not converge: " + summary.message};
  return summary.final_cost;
}

}  // namespace

Result<AdjustedLens> adjust_lens(const Board& board, std::span<const BoardView> views, const LensValues& start,
                                 const LensAdjustmentConfig& config) {
  auto lens = start.parameters();
  if (config.one_focal) lens[0] = lens[1] = 0.5 * (lens[0] + lens[1]);
  Common common;
  std::ranges::copy(board.bend_m, std::ranges::copy(lens, common.begin()).out);
  const auto fixed = fixed_parameters(start.model, config.one_focal);
  std::vector<Pose> poses;
  int corners = 0;
  for (const BoardView& view : views) {
    const auto pose = board_pose(board, view, start);
    if (!pose) return Error{ErrorCode::Invalid, view.name + ": no start value of the board's pose can be computed"};
    poses.push_back(numbers_of(*pose));
    if (!has_pixels(board, view, start, poses.back()))
      return Error{ErrorCode::Invalid, view.name + ": a part of the board would be behind the lens"};
    corners += static_cast<int>(view.corners.size());
  }
  AdjustedLens out;
  out.observations = 2 * corners;
  out.unknowns = kLensParameters - static_cast<int>(fixed.size()) + 6 * static_cast<int>(poses.size()) +
                 (config.is_bent ? static_cast<int>(kBendTerms) : 0);
  if (out.observations <= out.unknowns)
    return Error{ErrorCode::Invalid, fmt::format("{} corners in {} views are too few for {} unknowns", corners,
                                                 views.size(), out.unknowns)};

  ceres::Problem problem;
  add_corners(board, views, start.model, config, fixed, common, poses, problem);
  const auto cost = solve(config, common, poses, problem);
  if (!cost.ok()) return cost.error();

  std::copy_n(common.begin(), lens.size(), lens.begin());
  Board adjusted_board = board;
  std::copy_n(common.begin() + kLensParameters, kBendTerms, adjusted_board.bend_m.begin());
  out.bend_m = adjusted_board.bend_m;
  if (config.one_focal) lens[1] = lens[0];
  out.lens = start;
  out.lens.set_parameters(lens);
  out.cost = *cost;
  double sum = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    out.poses.push_back(pose_of(poses[v]));
    out.residuals.emplace_back();
    for (const SeenCorner& corner : views[v].corners) {
      Eigen::Vector2d residual;
      CornerResidual{start.model, false, adjusted_board.corner(corner.index), corner.pixel}(
          lens.data(), poses[v].data(), residual.data());
      out.residuals.back().push_back(residual);
      sum += residual.squaredNorm();
    }
  }
  out.rms_px = std::sqrt(sum / corners);
  out.sigma_px = std::sqrt(sum / (out.observations - out.unknowns));
  if (!lens_covariance(problem, common, poses, fixed, config.is_bent, out))
    return Error{ErrorCode::Unavailable,
                 "the views do not determine the lens: tilt the board against the image, differently in each view"};
  if (config.one_focal) {
    out.covariance.row(1) = out.covariance.row(0);
    out.covariance.col(1) = out.covariance.col(0);
    out.focal_noise_px[1] = out.focal_noise_px[0];
  }
  return out;
}

std::optional<BoardPose> resect_board(const Board& board, const BoardView& view, const LensValues& lens) {
  const auto start = board_pose(board, view, lens);
  if (!start) return std::nullopt;
  auto values = lens.parameters();
  Pose pose = numbers_of(*start);
  if (!has_pixels(board, view, lens, pose)) return std::nullopt;
  ceres::Problem problem;
  for (const SeenCorner& corner : view.corners)
    problem.AddResidualBlock(corner_cost(board, corner, lens.model, false), nullptr, values.data(), pose.data());
  problem.SetParameterBlockConstant(values.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  return pose_of(pose);
}

}  // namespace hueline::calibration
