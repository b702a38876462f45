#include "calibration/boresight/boresight_normals.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "calibration/boresight/plane_sums.hpp"

namespace hueline::calibration {
namespace {

Eigen::Quaterniond turned(const Eigen::Vector3d& by) {
  const double angle = by.norm();
  return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, by / angle)) : Eigen::Quaterniond::Identity();
}

constexpr int kRow = 18;  // six columns of the mounting, twice six of the trajectory correction
constexpr int kFewest = 12, kFewestOfPass = 4;
constexpr int kRobustFits = 2;

/// A return with everything that the adjustment of its patch needs.
struct Look {
  Eigen::Vector3d p_enu, q_body, arm_body;  // the return in Body, with and without the lever arm
  Eigen::Quaterniond q_enu_body;            // with the trajectory correction
  TrajectoryCorrection::Place place;
  double sigma_range_m, range_m, sigma = 1, off = 0, weight = 0;
  std::size_t scanner;
};

/// One patch: its returns, its plane, and its part of the normal equations in columns of its own.
class PatchNormals {
 public:
  PatchNormals(const BoresightDrive& drive, const Patch& patch, const BoresightState& state,
               const BoresightWeights& weights)
      : patch_(patch), state_(state), weights_(weights) {
    for (const std::uint32_t i : patch.returns) {
      const BoresightReturn& one = drive.returns[i];
      Look look;
      look.place = state.trajectory.at(static_cast<double>(one.time_s));
      const Vector6d correction = state.trajectory.value(look.place);
      look.q_enu_body = one.q_enu_body.cast<double>() * turned(correction.tail<3>());
      look.scanner = one.scanner;
      look.arm_body = state.mounts[one.scanner].rotation * one.p_scanner.cast<double>();
      look.q_body = look.arm_body + state.mounts[one.scanner].translation;
      look.p_enu = one.body_enu + correction.head<3>() + look.q_enu_body * look.q_body;
      look.range_m = look.arm_body.norm();
      look.sigma_range_m = drive.scanners[one.scanner].sigma_range_m;
      looks_.push_back(look);
    }
    origin_ = looks_[0].p_enu;
    normal_ = patch.normal_enu;
    centre_ = Eigen::Vector3d::Zero();
    for (const Look& look : looks_) centre_ += (look.p_enu - origin_) / static_cast<double>(looks_.size());
  }

  void fit_plane() {
    // The first fits are robust, because returns that are not of the plane have moved the mean.
    for (int i = 0; i < 2 * kRobustFits; ++i) {
      i < kRobustFits ? weigh_robust() : weigh();
      PlaneSums sums;
      for (const Look& look : looks_) sums.add(look.p_enu - origin_, look.weight);
      if (!(sums.weight > 0)) return;
      normal_ = sums.axes().eigenvectors().col(0);
      centre_ = sums.centre();
    }
    weigh();
  }

  /// Returns false if too few returns are left, or if they are all of one pass.
  bool is_seen_twice() const {
    int all = 0, twice = 0;
    std::array<int, 256> of_pass{};
    for (std::size_t i = 0; i < looks_.size(); ++i)
      if (looks_[i].weight > 0) {
        ++all;
        twice += ++of_pass[patch_.pass[i]] == kFewestOfPass;
      }
    return all >= kFewest && twice >= 2;
  }

  void add_to(BoresightNormals& out) const {
    std::map<std::size_t, Eigen::Index> knots;
    for (const Look& look : looks_)
      if (look.weight > 0) knots[look.place.knot] = knots[look.place.knot + 1] = 0;
    const auto mounts = static_cast<Eigen::Index>(6 * state_.mounts.size());
    Eigen::Index columns = mounts;
    for (auto& [knot, at] : knots) {
      at = columns;
      columns += 6;
    }
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(columns, columns), B = Eigen::MatrixXd::Zero(columns, 3);
    Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
    Eigen::VectorXd g = Eigen::VectorXd::Zero(columns);
    Eigen::Vector3d h = Eigen::Vector3d::Zero();
    const Eigen::Vector3d u = normal_.unitOrthogonal(), v = normal_.cross(u);
    for (const Look& look : looks_) {
      if (!(look.weight > 0)) continue;
      const Eigen::Vector3d m = look.q_enu_body.conjugate() * normal_, r = look.p_enu - origin_ - centre_;
      Vector6d mount, trajectory;
      mount << look.arm_body.cross(m), m;
      trajectory << normal_, look.q_body.cross(m);
      Eigen::Matrix<double, kRow, 1> row;
      row << mount, (1 - look.place.share) * trajectory.cwiseProduct(state_.trajectory.sigma(look.place.knot)),
          look.place.share * trajectory.cwiseProduct(state_.trajectory.sigma(look.place.knot + 1));
      const Eigen::Vector3d plane(u.dot(r), v.dot(r), -1);
      const std::array<Eigen::Index, 3> at{static_cast<Eigen::Index>(6 * look.scanner), knots[look.place.knot],
                                           knots[look.place.knot + 1]};
      const double e = normal_.dot(r);
      for (Eigen::Index i = 0; i < 3; ++i) {
        const auto part = row.segment<6>(6 * i);
        for (Eigen::Index j = 0; j < 3; ++j)
          A.block<6, 6>(at[i], at[j]) += look.weight * part * row.segment<6>(6 * j).transpose();
        B.middleRows<6>(at[i]) += look.weight * part * plane.transpose();
        g.segment<6>(at[i]) += look.weight * e * part;
      }
      C += look.weight * plane * plane.transpose();
      h += look.weight * e * plane;
      out.squares += e * e;
      out.weight += look.weight;
      ++out.returns;
      ++out.of_scanner[look.scanner];
    }
    const Eigen::LDLT<Eigen::Matrix3d> factors(C);
    const Eigen::MatrixXd X = factors.solve(B.transpose());
    A -= B * X;
    g -= X.transpose() * h;
    // Adds the patch's columns to the columns of all.
    std::vector<std::pair<Eigen::Index, Eigen::Index>> parts;
    for (Eigen::Index i = 0; i < mounts; i += 6) parts.emplace_back(i, i);
    for (const auto& [knot, at] : knots) parts.emplace_back(at, mounts + static_cast<Eigen::Index>(6 * knot));
    for (const auto& [from, to] : parts) {
      out.gradient.segment<6>(to) += g.segment<6>(from);
      for (const auto& [from2, to2] : parts) out.information.block<6, 6>(to, to2) += A.block<6, 6>(from, from2);
    }
    out.without_pos += A.topLeftCorner(mounts, mounts);
    out.normals += normal_ * normal_.transpose();
    ++out.facing[static_cast<std::size_t>(patch_.facing)];
    ++out.patches;
  }

  const std::vector<Look>& looks() const { return looks_; }

 private:
  void weigh_robust() {
    for (Look& look : looks_) {
      see(look);
      const double off = look.off / (weights_.gate_m > 0 ? weights_.gate_m : 2 * look.sigma),
                   keeps = 1 / (1 + off * off);
      look.weight = keeps * keeps / (look.sigma * look.sigma);
    }
  }

  void weigh() {
    if (weights_.gate_m > 0) return weigh_robust();
    std::vector<int> together(state_.trajectory.knots() * state_.mounts.size(), 0);
    const auto group = [&](const Look& look) { return look.scanner * state_.trajectory.knots() + look.place.knot; };
    for (Look& look : looks_) {
      see(look);
      look.weight = std::abs(look.off) < weights_.reject * look.sigma;
      together[group(look)] += look.weight > 0;
    }
    for (Look& look : looks_)
      look.weight /= look.sigma * look.sigma + together[group(look)] * weights_.surface_m * weights_.surface_m;
  }

  /// Computes the distance of a return from the plane, and the sigma of that distance.
  void see(Look& look) const {
    look.off = normal_.dot(look.p_enu - origin_ - centre_);
    look.sigma = weights_.gate_m;
    if (weights_.gate_m > 0) return;
    const double cosine = std::abs((look.q_enu_body * look.arm_body).dot(normal_)) / look.range_m,
                 sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    look.sigma =
        weights_.unit[look.scanner] *
        std::hypot(look.sigma_range_m * cosine, weights_.sigma_angle * look.range_m * sine, weights_.surface_m);
  }

  const Patch& patch_;
  const BoresightState& state_;
  const BoresightWeights& weights_;
  std::vector<Look> looks_;
  Eigen::Vector3d origin_, normal_, centre_;  // centre_ is relative to origin_
};

}  // namespace

Eigen::Vector3d place_return(const BoresightReturn& one, const BoresightState& state) {
  const Vector6d correction = state.trajectory.value(state.trajectory.at(static_cast<double>(one.time_s)));
  const Eigen::Vector3d p_body = (state.mounts[one.scanner] * Point<Scanner>{one.p_scanner.cast<double>()}).xyz;
  return one.body_enu + correction.head<3>() + one.q_enu_body.cast<double>() * (turned(correction.tail<3>()) * p_body);
}

BoresightNormals boresight_normals(const BoresightDrive& drive, const std::vector<Patch>& patches,
                                   const BoresightState& state, const BoresightWeights& weights) {
  const auto mounts = static_cast<Eigen::Index>(6 * state.mounts.size()),
             all = mounts + static_cast<Eigen::Index>(6 * state.trajectory.knots());
  BoresightNormals out;
  out.information = Eigen::MatrixXd::Zero(all, all);
  out.gradient = Eigen::VectorXd::Zero(all);
  out.without_pos = Eigen::MatrixXd::Zero(mounts, mounts);
  out.off.resize(state.mounts.size());
  out.of_scanner.resize(state.mounts.size());
  for (const Patch& patch : patches) {
    PatchNormals part(drive, patch, state, weights);
    part.fit_plane();
    for (const Look& look : part.looks()) out.off[look.scanner].push_back(std::abs(look.off) / look.sigma);
    if (part.is_seen_twice()) part.add_to(out);
  }
  if (weights.gate_m > 0) return out;
  const double lowered = 1 / (1 + out.weight * weights.systematic_m * weights.systematic_m);
  out.information *= lowered;
  out.gradient *= lowered;
  out.without_pos *= lowered;
  return out;
}

}  // namespace hueline::calibration
