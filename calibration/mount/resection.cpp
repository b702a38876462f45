#include "calibration/mount/resection.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calibration/decompositions.hpp"

namespace hueline::calibration {
namespace {

constexpr int kTriples = 600;
// From this standard deviation on, the points count as not determining the rotation, rad.
constexpr double kVagueTurn = 0.035;
constexpr double kVagueCentre_m = 0.5;
// Median radius of a plane normal distribution, in standard deviations of one coordinate.
constexpr double kMedianOfRadius = 1.1774;
constexpr double kNowhere_px = 1e9;

/// Residual of one point: seen minus projected pixel over its standard deviation. The parameters are a small rotation
/// about the lens's axes after R, and the projection centre.
struct PointResidual {
  const LensValues* lens;
  Eigen::Matrix3d R_lens_scanner;
  const Correspondence* point;
  double weight;

  template <class T>
  bool operator()(const T* turn_centre, T* residual) const {
    T before[3], p_lens[3], values[kLensParameters], projected[2];
    for (int i = 0; i < 3; ++i) {
      before[i] = T(0);
      for (int j = 0; j < 3; ++j) before[i] += R_lens_scanner(i, j) * (point->p_scanner[j] - turn_centre[3 + j]);
    }
    ceres::AngleAxisRotatePoint(turn_centre, before, p_lens);
    const auto plain = lens->parameters();
    for (int i = 0; i < kLensParameters; ++i) values[i] = T(plain[static_cast<std::size_t>(i)]);
    if (!project_with(lens->model, values, p_lens, projected)) return false;
    residual[0] = weight * (point->pixel.x() - projected[0]);
    residual[1] = weight * (point->pixel.y() - projected[1]);
    return true;
  }
};
using PointCost = ceres::AutoDiffCostFunction<PointResidual, 2, 6>;

double pixel_error(const LensValues& lens, const Transform<Lens, Scanner>& T, const Correspondence& point) {
  const auto pixel = lens.project((T * Point<Scanner>{point.p_scanner}).xyz);
  return pixel ? (*pixel - point.pixel).norm() : kNowhere_px;
}

struct Start {
  Transform<Lens, Scanner> T;
  int agreeing = 0;
  double error2 = 0;
};

/// Returns the best of many minimal resections: the one with which most points agree, then the one with the smallest
/// sum of squares.
Start best_start(const LensValues& lens, const std::vector<Correspondence>& points,
                 const std::vector<Eigen::Vector3d>& rays, double agree_px) {
  Start best;
  std::uint64_t state = 88172645463325252ULL;  // a fixed seed, so that the same points give the same start
  const auto next = [&](std::size_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<std::size_t>(state % below);
  };
  for (int t = 0; t < kTriples; ++t) {
    const std::size_t i = next(points.size()), j = next(points.size()), k = next(points.size());
    if (i == j || j == k || i == k) continue;
    for (const auto& T :
         resect_three({rays[i], rays[j], rays[k]}, {points[i].p_scanner, points[j].p_scanner, points[k].p_scanner})) {
      Start one{T, 0, 0};
      for (const Correspondence& point : points) {
        const double error = pixel_error(lens, T, point);
        one.agreeing += error < agree_px;
        one.error2 += std::min(error * error, agree_px * agree_px);
      }
      if (one.agreeing > best.agreeing || (one.agreeing == best.agreeing && one.error2 < best.error2)) best = one;
    }
  }
  return best;
}

struct Fit {
  bool ok = false;
  Transform<Lens, Scanner> T;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
};

Fit fit(const LensValues& lens, const std::vector<Correspondence>& points, const std::vector<bool>& used,
        const std::vector<double>& weights, const Transform<Lens, Scanner>& start, double robust) {
  Fit out;
  const Eigen::Vector3d begin = start.inverse().translation;
  double x[6] = {0, 0, 0, begin.x(), begin.y(), begin.z()};
  ceres::Problem problem;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (used[i])
      problem.AddResidualBlock(
          new PointCost(new PointResidual{&lens, start.rotation.toRotationMatrix(), &points[i], weights[i]}),
          robust > 0 ? new ceres::CauchyLoss(robust) : nullptr, x);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-15;
  options.parameter_tolerance = 1e-13;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return out;
  const Eigen::Vector3d turn(x[0], x[1], x[2]), centre(x[3], x[4], x[5]);
  Eigen::Quaterniond q = start.rotation;
  if (turn.norm() > 0) q = Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * q;
  q.normalize();
  out.T = {q, -(q * centre)};
  // The normal matrix is evaluated where the small rotation is zero, so that it refers to rotations about the lens's
  // own axes.
  const double at[6] = {0, 0, 0, centre.x(), centre.y(), centre.z()};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!used[i]) continue;
    const PointCost cost(new PointResidual{&lens, q.toRotationMatrix(), &points[i], weights[i]});
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> J;
    double residual[2];
    const double* parameters[1] = {at};
    double* jacobians[1] = {J.data()};
    if (!cost.Evaluate(parameters, residual, jacobians)) return out;
    out.normal += J.transpose() * J;
  }
  out.ok = true;
  return out;
}

/// Returns the hint of an error message. One mirrored axis stands for all exchanges of axes that change their
/// handedness. The resection itself finds the other exchanges as a rotation.
std::string what_would_fit(const LensValues& lens, std::vector<Correspondence> points,
                           const std::vector<Eigen::Vector3d>& rays, double agree_px) {
  for (Correspondence& point : points) point.p_scanner.y() = -point.p_scanner.y();
  const Start mirrored = best_start(lens, points, rays, agree_px);
  if (3 * static_cast<std::size_t>(mirrored.agreeing) < 2 * points.size()) return {};
  return fmt::format("; mirrored, {} would agree: two axes are exchanged, or one has the wrong sign",
                     mirrored.agreeing);
}

/// Returns the direction of each point's pixel. Error: Invalid if a pixel has none or a point is not finite.
Result<std::vector<Eigen::Vector3d>> rays_of(const LensValues& lens, const std::vector<Correspondence>& points) {
  std::vector<Eigen::Vector3d> rays;
  for (const Correspondence& point : points) {
    const auto ray = lens.direction(point.pixel);
    if (!ray || !point.p_scanner.allFinite())
      return Error{ErrorCode::Invalid,
                   fmt::format("point {} at ({:.1f}, {:.1f}) px: no direction of the lens falls on this pixel",
                               point.name, point.pixel.x(), point.pixel.y())};
    rays.push_back(*ray);
  }
  return rays;
}

/// Returns 1 over the standard deviation of each point's pixel. The start is good enough to compute it from the
/// distances.
std::vector<double> weights_of(const LensValues& lens, const std::vector<Correspondence>& points,
                               const Transform<Lens, Scanner>& start, const ResectionConfig& config) {
  std::vector<double> weights;
  for (const Correspondence& point : points) {
    const double distance = std::max(0.1, (start * Point<Scanner>{point.p_scanner}).xyz.norm());
    weights.push_back(1.0 / std::hypot(config.sigma_px, lens.focal_px.mean() * config.sigma_point_m / distance));
  }
  return weights;
}

/// Returns which points agree with `T`. They are compared with the noise of those that were used for it.
std::vector<bool> agreeing_with(const Transform<Lens, Scanner>& T, const LensValues& lens,
                                const std::vector<Correspondence>& points, const std::vector<double>& weights,
                                const std::vector<bool>& used, double outlier_sigma) {
  std::vector<double> radii;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (used[i]) radii.push_back(weights[i] * pixel_error(lens, T, points[i]));
  std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
  // Few points determine the noise badly.
  const double scale = radii[radii.size() / 2] / kMedianOfRadius * (1 + 5.0 / static_cast<double>(radii.size()));
  std::vector<bool> agreeing(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    agreeing[i] = weights[i] * pixel_error(lens, T, points[i]) <= std::max(outlier_sigma * scale, 1e-6);
  return agreeing;
}

/// Fits the pose to the points that agree with each other, and sets `used` to them. They are at least `needed`, or the
/// fit before is kept.
Fit fit_majority(const LensValues& lens, const std::vector<Correspondence>& points, const std::vector<double>& weights,
                 const Transform<Lens, Scanner>& start, const ResectionConfig& config, int needed,
                 std::vector<bool>& used) {
  used.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) used[i] = pixel_error(lens, start, points[i]) < 3 * config.agree_px;
  Fit found = fit(lens, points, used, weights, start, 2.0);
  for (int round = 0; round < 4 && found.ok; ++round) {
    const auto again = agreeing_with(found.T, lens, points, weights, used, config.outlier_sigma);
    if (std::count(again.begin(), again.end(), true) < needed || (round > 0 && again == used)) break;
    used = again;
    found = fit(lens, points, used, weights, found.T, 0);
  }
  return found;
}

/// Sets the residuals of all points, and the statistics of those that were used.
void set_residuals(const LensValues& lens, const std::vector<Correspondence>& points,
                   const std::vector<double>& weights, const Transform<Lens, Scanner>& T, Resection& out) {
  double sum = 0, weighted = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = lens.project((T * Point<Scanner>{points[i].p_scanner}).xyz);
    out.residuals.push_back(pixel ? Eigen::Vector2d(points[i].pixel - *pixel)
                                  : Eigen::Vector2d(kNowhere_px, kNowhere_px));
    if (!out.is_used[i]) continue;
    sum += out.residuals.back().squaredNorm();
    weighted += weights[i] * weights[i] * out.residuals.back().squaredNorm();
  }
  out.rms_px = std::sqrt(sum / out.used);
  out.unit_sigma = std::sqrt(weighted / (2 * out.used - 6));
}

}  // namespace

std::string ResectionConfig::validate() const {
  if (!(sigma_px > 0 && sigma_px < 100)) return fmt::format("sigma_px is {}; allowed: above 0, below 100 px", sigma_px);
  if (!(sigma_point_m >= 0 && sigma_point_m < 10))
    return fmt::format("sigma_point_m is {}; allowed: 0 to 10 m", sigma_point_m);
  if (!(agree_px > 0)) return fmt::format("agree_px is {}; allowed: above 0", agree_px);
  if (!(outlier_sigma >= 2.5)) return fmt::format("outlier_sigma is {}; allowed: 2.5 or more", outlier_sigma);
  return {};
}

Result<Resection> resect(const LensValues& lens, const std::vector<Correspondence>& points,
                         const ResectionConfig& config) {
  if (const std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (points.size() < 4)
    return Error{ErrorCode::Invalid,
                 fmt::format("there are {} points; a resection needs 4, and 10 or more to estimate its own error",
                             points.size())};
  const auto rays = rays_of(lens, points);
  if (!rays.ok()) return rays.error();
  const Start start = best_start(lens, points, *rays, config.agree_px);
  const int needed = std::max(4, static_cast<int>((points.size() + 1) / 2));
  if (start.agreeing == 0)
    return Error{ErrorCode::Unavailable,
                 "no three of the points determine a pose: they lie near a line, or in one spot"};
  if (start.agreeing < needed)
    return Error{ErrorCode::Unavailable,
                 fmt::format("only {} of {} points agree on one pose within {} px{}", start.agreeing, points.size(),
                             config.agree_px, what_would_fit(lens, points, *rays, config.agree_px))};
  const auto weights = weights_of(lens, points, start.T, config);
  Resection out;
  const Fit found = fit_majority(lens, points, weights, start.T, config, needed, out.is_used);
  out.used = static_cast<int>(std::count(out.is_used.begin(), out.is_used.end(), true));
  if (!found.ok || out.used < needed)
    return Error{ErrorCode::Unavailable,
                 fmt::format("only {} of {} points agree with each other", out.used, points.size())};
  out.T_scanner_lens = found.T.inverse();
  set_residuals(lens, points, weights, found.T, out);
  const SymmetricEigen eigen = symmetric_eigen(found.normal);
  const Eigen::MatrixXd inverse =
      eigen.vectors * eigen.values.cwiseMax(1e-12).cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  out.covariance = inverse * (out.unit_sigma * out.unit_sigma);
  // The pose is judged with the stated noise, because few points always fit well.
  const double turn = std::sqrt(inverse.topLeftCorner(3, 3).diagonal().maxCoeff()),
               centre = std::sqrt(inverse.bottomRightCorner(3, 3).diagonal().maxCoeff());
  if (turn > kVagueTurn || centre > kVagueCentre_m)
    return Error{ErrorCode::Unavailable,
                 fmt::format("the points do not determine the pose (rotation +- {:.2f} deg, centre +- {:.2f} m): they "
                             "lie near a line, in one spot, or all far away",
                             turn * 57.29578, centre)};
  return out;
}

}  // namespace hueline::calibration
