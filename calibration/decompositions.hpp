#pragma once

#include <Eigen/Core>

/// Eigen's decompositions for the small matrices of the adjustments. Each costs seconds to compile, so they are
/// compiled here once; code that decomposes millions of matrices uses Eigen's own for matrices of a fixed size.
namespace hueline::calibration {

/// A symmetric matrix as vectors * values.asDiagonal() * vectors.transpose().
struct SymmetricEigen {
  Eigen::VectorXd values;   ///< increasing
  Eigen::MatrixXd vectors;  ///< orthonormal columns, in the order of `values`
};
/// Returns the eigenvalues and eigenvectors of a symmetric matrix; only its lower triangle is read.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);

/// A matrix as U * values.asDiagonal() * V.transpose().
struct SingularValues3 {
  Eigen::Matrix3d U, V;    ///< orthonormal columns; the determinants are 1 or -1
  Eigen::Vector3d values;  ///< decreasing, not negative
};
/// Returns the singular value decomposition of a matrix of 3 x 3.
SingularValues3 singular_values(const Eigen::Matrix3d& A);

}  // namespace hueline::calibration
