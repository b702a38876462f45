#include "calibration/boresight/mount_covariance.hpp"

#include <Eigen/Cholesky>

namespace hueline::calibration {

Eigen::MatrixXd mount_information(const BoresightNormals& normals, const TrajectoryCorrection& trajectory) {
  const Eigen::Index mounts = normals.without_pos.rows(), rest = normals.information.rows() - mounts;
  Eigen::MatrixXd information = normals.information;
  Eigen::VectorXd unused = Eigen::VectorXd::Zero(information.rows());
  trajectory.add_prior(information, unused, mounts);
  const Eigen::MatrixXd B = information.topRightCorner(mounts, rest);
  const Eigen::MatrixXd X = information.bottomRightCorner(rest, rest).llt().solve(B.transpose());
  return information.topLeftCorner(mounts, mounts) - B * X;
}

Eigen::MatrixXd covariance_with_held(const Eigen::MatrixXd& information, const std::vector<bool>& held,
                                     double sigma_held) {
  const Eigen::Index count = information.rows();
  Eigen::MatrixXd free = information, K = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd is_held(count);
  for (Eigen::Index i = 0; i < count; ++i) is_held[i] = held[static_cast<std::size_t>(i)];
  for (Eigen::Index i = 0; i < count; ++i) {
    if (is_held[i] == 0) continue;
    K.col(i) = -information.col(i).cwiseProduct((1 - is_held.array()).matrix());
    free.row(i).setZero();
    free.col(i).setZero();
    free(i, i) = 1;
  }
  const auto factors = free.llt();
  K = factors.solve(K).eval();
  Eigen::MatrixXd out = factors.solve(Eigen::MatrixXd::Identity(count, count));
  out.diagonal() -= is_held;
  K.diagonal() += is_held;
  return out + sigma_held * sigma_held * K * K.transpose();
}

}  // namespace hueline::calibration
