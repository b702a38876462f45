#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

namespace hueline::calibration {

/// Weighted sums of points, and from them the plane with the least weighted sum of squared distances.
struct PlaneSums {
  double weight = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();  // lower triangle

  /// Adds the point `p` with weight `w`.
  void add(const Eigen::Vector3d& p, double w) {
    weight += w;
    sum += w * p;
    for (Eigen::Index i = 0; i < 3; ++i)
      for (Eigen::Index j = 0; j <= i; ++j) squares(i, j) += w * p[i] * p[j];
  }
  Eigen::Vector3d centre() const { return sum / weight; }
  /// Returns the eigenvectors of the points' covariance. Eigenvalues are variances in ascending order; the first
  /// eigenvector is the plane's normal.
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes() const {
    const Eigen::Vector3d c = centre();
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares / weight - c * c.transpose());
  }
};

}  // namespace hueline::calibration
