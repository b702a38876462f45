#include "calibration/mount/head_adjustment.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/mount/intensity_relation.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr double kFarthest = 1.5 * kRadPerDeg;  // largest rotation from the start
constexpr double kBegin = 0.5 * kRadPerDeg;     // expected error of the start, which gives the width of the first blur
constexpr double kDoneTurn = 0.0005 * kRadPerDeg, kDoneTime_s = 2e-5;
constexpr double kFinest_px =
    0.05;  // Least sigma of what all images have in common; simulated drives show 0.03 to 0.1.
constexpr std::size_t kStrideWhenBlurred = 3;
constexpr int kMostSteps = 12;               // most steps at one blur
constexpr std::size_t kFewestPatches = 100;  // the 27 patches of one real image gave an error of a quarter of a degree
constexpr double kWeakestTurn = 0.5 * kRadPerDeg;  // largest sigma of a rotation that counts as determined

/// Returns the covariance of the gradients of parts of the shots at the optimum of their sum.
Eigen::Matrix4d pull_of(const std::vector<HeadNormals>& shots, const std::vector<std::size_t>& part,
                        std::size_t parts) {
  std::vector<Eigen::Vector4d> pulls(parts, Eigen::Vector4d::Zero());
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < shots.size(); ++i) {
    pulls[part[i]] += shots[i].gradient;
    mean += shots[i].gradient / static_cast<double>(parts);
  }
  Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
  if (parts < 2) return out;
  for (const Eigen::Vector4d& pull : pulls) out += (pull - mean) * (pull - mean).transpose();
  return out * static_cast<double>(parts) / static_cast<double>(parts - 1);
}

/// Returns the widths of blur, from the expected error of the start to the finest, px.
std::vector<float> blurs_of(double focal_px) {
  std::vector<float> out;
  for (auto blur = static_cast<float>(2 * focal_px * kBegin); blur > 1; blur /= 2) out.push_back(blur);
  out.push_back(1.0F);
  return out;
}

/// Returns the step to the optimum. The last of the four unknowns, the time, is 0 unless `free` is 4.
/// Error: Unavailable if too few patches contribute, or if they do not determine the rotation.
Result<HeadCorrection> step_of(const HeadNormals& sum, Eigen::Index free) {
  if (sum.patches < kFewestPatches)
    return Error{ErrorCode::Unavailable,
                 fmt::format("laser intensity follows the grey levels in {} patches of the images; {} are needed",
                             sum.patches, kFewestPatches)};
  const Eigen::MatrixXd information = sum.information.topLeftCorner(free, free);
  const Eigen::LDLT<Eigen::MatrixXd> factors(information);
  const Eigen::MatrixXd inverse = factors.solve(Eigen::MatrixXd::Identity(free, free));
  if (!(factors.isPositive() && inverse.allFinite() &&
        inverse.topLeftCorner(3, 3).trace() < kWeakestTurn * kWeakestTurn))
    return Error{
        ErrorCode::Unavailable,
        "the patches in which laser intensity follows the grey levels do not determine the rotation of the head"};
  HeadCorrection by = HeadCorrection::Zero();
  by.head(free) = -factors.solve(sum.gradient.head(free));
  return by;
}

/// Returns the covariance of the result from the differences between parts of the shots. Neighbouring shots see the
/// same objects and therefore have common errors. Stretches of the drive are independent of each other. So are lenses,
/// because each lens has its own calibration error in all of its images.
Eigen::Matrix4d covariance_of(const std::vector<AlignmentShot>& shots, const std::vector<HeadNormals>& of_shots,
                              const HeadNormals& sum, std::size_t groups, std::size_t lenses, Eigen::Index free,
                              double focal_px) {
  std::vector<std::size_t> stretches, of_lens;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    stretches.push_back(i * groups / shots.size());
    of_lens.push_back(shots[i].lens);
  }
  const Eigen::MatrixXd inverse =
      Eigen::LDLT<Eigen::MatrixXd>(Eigen::MatrixXd(sum.information.topLeftCorner(free, free)))
          .solve(Eigen::MatrixXd::Identity(free, free));
  const Eigen::Matrix4d pulls = pull_of(of_shots, stretches, groups) + pull_of(of_shots, of_lens, lenses);
  Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
  out.topLeftCorner(free, free) = inverse * pulls.topLeftCorner(free, free) * inverse;
  out.topLeftCorner<3, 3>().diagonal().array() += std::pow(kFinest_px / focal_px, 2);
  return out;
}

}  // namespace

Result<HeadAdjustment> adjust_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                                   const Transform<Body, CameraHead>& start, double time_offset_s, bool time_is_free,
                                   const AlignmentConfig& config) {
  const IntensityRelation relation(lenses, shots, start, kFarthest / kRadPerDeg);
  HeadAdjustment out;
  out.T_body_head = start;
  out.time_offset_s = time_offset_s;
  const double focal = lenses[shots[0].lens].values.focal_px.mean();
  const std::vector<float> blurs = blurs_of(focal);
  const Eigen::Index free = time_is_free ? 4 : 3;
  std::vector<HeadNormals> of_shots(shots.size());
  HeadNormals sum;
  for (std::size_t level = 0; level < blurs.size(); ++level) {
    const bool is_last = level + 1 == blurs.size();
    for (int step = 0;; ++step) {
      sum = {};
      for (std::size_t i = 0; i < shots.size(); ++i) {
        if (config.progress)
          config.progress(fmt::format("adjusting, blur {:.1f} px, step {}", blurs[level], step + 1),
                          static_cast<double>(i) / static_cast<double>(shots.size()));
        of_shots[i] = relation.normals(i, BlurredImage(shots[i].image, blurs[level]), out.T_body_head,
                                       out.time_offset_s, is_last ? 1 : kStrideWhenBlurred);
        sum += of_shots[i];
      }
      const auto wanted = step_of(sum, free);
      if (!wanted.ok()) return wanted.error();
      HeadCorrection by = *wanted;
      // The linearisation is valid only within the width of the blur.
      const double reach = static_cast<double>(blurs[level]) / focal;
      if (by.head<3>().norm() > reach) by *= reach / by.head<3>().norm();
      out.T_body_head = corrected(out.T_body_head, by);
      out.time_offset_s += by[3];
      ++out.steps;
      if (!(start.rotation.angularDistance(out.T_body_head.rotation) < kFarthest))
        return Error{ErrorCode::Unavailable, fmt::format("the adjustment of grey levels to intensities moves the head "
                                                         "farther than {:.1f} deg from the result of the search",
                                                         kFarthest / kRadPerDeg)};
      const double enough = is_last ? 1 : 10;
      if (by.head<3>().norm() < enough * kDoneTurn && std::abs(by[3]) < enough * kDoneTime_s) break;
      if (step + 1 == kMostSteps) {
        if (is_last && by.head<3>().norm() > 20 * kDoneTurn)
          return Error{ErrorCode::Unavailable, "the adjustment of grey levels to intensities does not converge"};
        break;
      }
    }
  }
  out.patches = sum.patches;
  out.samples = sum.samples;
  const std::size_t groups = std::min(static_cast<std::size_t>(std::max(0, config.groups)), shots.size());
  if (groups < 2) return out;
  out.covariance = covariance_of(shots, of_shots, sum, groups, lenses.size(), free, focal);
  return out;
}

}  // namespace hueline::calibration
