#include "calibration/targets/orientation.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calibration/decompositions.hpp"

namespace hueline::calibration {
namespace {

using Matrix37 = Eigen::Matrix<double, 3, 7>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Returns the sum of survey * scanner^T about the means.
Eigen::Matrix3d correlation(std::span<const Eigen::Vector3d> scanner, std::span<const Eigen::Vector3d> survey) {
  const Eigen::Vector3d a = mean_of(scanner), b = mean_of(survey);
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < scanner.size(); ++i) H += (survey[i] - b) * (scanner[i] - a).transpose();
  return H;
}

/// Returns the derivative of a scanner point's place in the survey with respect to rotation, translation and scale.
Matrix37 derivative(const Orientation& orientation, const Eigen::Vector3d& p_scanner) {
  Matrix37 A;
  const Eigen::Vector3d turned = orientation.T_survey_scanner.rotation * p_scanner;
  A.leftCols<3>() = -cross_matrix(orientation.scale * turned);
  A.middleCols<3>(3) = Eigen::Matrix3d::Identity();
  A.col(6) = turned;
  return A;
}

/// The normal equations of the adjustment, with seven unknowns a station: rotation, translation and scale. The places
/// of the targets are eliminated. All coordinates of the survey are relative to one origin.
class NormalEquations {
 public:
  NormalEquations(std::size_t stations, bool estimate_scale)
      : estimate_scale_(estimate_scale),
        N_(Eigen::MatrixXd::Zero(index(stations), index(stations))),
        n_(Eigen::VectorXd::Zero(index(stations))) {
    if (estimate_scale) return;
    for (std::size_t s = 0; s < stations; ++s) N_(index(s) + 6, index(s) + 6) = 1;
  }

  /// Adds the surveyed place of a station. `off` is this place minus the present one.
  void add_prior(std::size_t station, const Eigen::Vector3d& off, double sigma_m) {
    const Eigen::Index at = index(station);
    const double weight = 1 / (sigma_m * sigma_m);
    N_.block<3, 3>(at + 3, at + 3) += weight * Eigen::Matrix3d::Identity();
    n_.segment<3>(at + 3) += weight * off;
    chi_squared_ += weight * off.squaredNorm();
  }

  /// Adds all observations of one target. Returns its adjusted place.
  Eigen::Vector3d add_target(const Eigen::Vector3d& surveyed, double sigma_m,
                             const std::vector<CentreObservation>& observations,
                             const std::vector<AdjustedStation>& stations) {
    struct Part {
      Eigen::Index at;
      Matrix37 A;
      Eigen::Matrix3d W;
      Eigen::Vector3d predicted;
    };
    std::vector<Part> parts;
    const double prior = 1 / (sigma_m * sigma_m);
    Eigen::Matrix3d M = prior * Eigen::Matrix3d::Identity();
    Eigen::Vector3d m = prior * surveyed;
    for (const CentreObservation& seen : observations) {
      const Orientation& orientation = stations[seen.station].orientation;
      const Eigen::Matrix3d R = orientation.scale * orientation.T_survey_scanner.rotation.toRotationMatrix();
      Part part{index(seen.station), derivative(orientation, seen.centre_scanner),
                (R * seen.covariance * R.transpose()).inverse(), orientation.survey_from_scanner(seen.centre_scanner)};
      if (!estimate_scale_) part.A.col(6).setZero();
      M += part.W;
      m += part.W * part.predicted;
      parts.push_back(part);
    }
    // The target's own place is eliminated. It is the weighted mean of what the stations and the survey give.
    const Eigen::Matrix3d M_inverse = M.inverse();
    const Eigen::Vector3d place = M_inverse * m;
    chi_squared_ += prior * (place - surveyed).squaredNorm();
    for (const Part& a : parts) {
      const Eigen::Vector3d off = place - a.predicted;
      chi_squared_ += off.dot(a.W * off);
      n_.segment<7>(a.at) += a.A.transpose() * (a.W * off);
      N_.block<7, 7>(a.at, a.at) += a.A.transpose() * a.W * a.A;
      for (const Part& b : parts) N_.block<7, 7>(a.at, b.at) -= a.A.transpose() * a.W * M_inverse * b.W * b.A;
    }
    return place;
  }

  /// Factorises the equations. Returns false if they do not determine all unknowns.
  bool factorise() {
    // Rotations are of order 1 and translations of order 100 m. Scaling to a unit diagonal makes the smallest pivot
    // show what is not determined.
    unit_ = N_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    solver_.compute(unit_.asDiagonal() * N_ * unit_.asDiagonal());
    return solver_.vectorD().minCoeff() > 1e-10;
  }
  /// Returns the changes of the unknowns. Call factorise() before.
  Eigen::VectorXd step() const { return unit_.asDiagonal() * solver_.solve(unit_.asDiagonal() * n_); }
  /// Returns the covariance of the unknowns. Call factorise() before.
  Eigen::MatrixXd inverse() const { return unit_.asDiagonal() * solver_.solve(Eigen::MatrixXd(unit_.asDiagonal())); }
  double chi_squared() const { return chi_squared_; }
  /// Returns the index of a station's first unknown.
  static Eigen::Index index(std::size_t station) { return static_cast<Eigen::Index>(7 * station); }

 private:
  bool estimate_scale_;
  Eigen::MatrixXd N_;
  Eigen::VectorXd n_, unit_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
  double chi_squared_ = 0;
};

/// Changes the orientations by one step of the adjustment.
void apply_step(const Eigen::VectorXd& step, bool estimate_scale, std::vector<AdjustedStation>& stations) {
  for (std::size_t s = 0; s < stations.size(); ++s) {
    Orientation& orientation = stations[s].orientation;
    const Eigen::Index at = NormalEquations::index(s);
    const Eigen::Vector3d half = step.segment<3>(at) / 2;
    orientation.T_survey_scanner.rotation =
        (rotation_from_rodrigues(half) * orientation.T_survey_scanner.rotation).normalized();
    orientation.T_survey_scanner.translation += step.segment<3>(at + 3);
    if (estimate_scale) orientation.scale += step[at + 6];
  }
}

/// Sets the covariance of each station. A scale that is not estimated has none.
void set_covariances(const Eigen::MatrixXd& inverse, bool estimate_scale, std::vector<AdjustedStation>& stations) {
  for (std::size_t s = 0; s < stations.size(); ++s) {
    stations[s].covariance = inverse.block<7, 7>(NormalEquations::index(s), NormalEquations::index(s));
    if (estimate_scale) continue;
    stations[s].covariance.row(6).setZero();
    stations[s].covariance.col(6).setZero();
  }
}

}  // namespace

std::optional<Eigen::Vector3d> rodrigues_parameters(const Eigen::Quaterniond& rotation) {
  if (std::abs(rotation.w()) < 1e-4) return {};
  return Eigen::Vector3d(rotation.vec() / rotation.w());
}

Eigen::Quaterniond rotation_from_rodrigues(const Eigen::Vector3d& abc) {
  return Eigen::Quaterniond(1, abc.x(), abc.y(), abc.z()).normalized();
}

std::optional<Orientation> orient_closed_form(std::span<const Eigen::Vector3d> scanner,
                                              std::span<const Eigen::Vector3d> survey) {
  if (scanner.size() < 3 || scanner.size() != survey.size()) return {};
  const SingularValues3 parts = singular_values(correlation(scanner, survey));
  if (!(parts.values[1] > 1e-12 * parts.values[0])) return {};
  Eigen::Matrix3d proper = Eigen::Matrix3d::Identity();
  proper(2, 2) = (parts.U * parts.V.transpose()).determinant() < 0 ? -1 : 1;
  Orientation out;
  out.T_survey_scanner.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(parts.U * proper * parts.V.transpose())).normalized();
  out.T_survey_scanner.translation = mean_of(survey) - out.T_survey_scanner.rotation * mean_of(scanner);
  return out;
}

double mirrored_rms(std::span<const Eigen::Vector3d> scanner, std::span<const Eigen::Vector3d> survey) {
  const SingularValues3 parts = singular_values(correlation(scanner, survey));
  Eigen::Matrix3d improper = Eigen::Matrix3d::Identity();
  improper(2, 2) = (parts.U * parts.V.transpose()).determinant() < 0 ? 1 : -1;
  const Eigen::Matrix3d M = parts.U * improper * parts.V.transpose();
  const Eigen::Vector3d a = mean_of(scanner), b = mean_of(survey);
  double sum = 0;
  for (std::size_t i = 0; i < scanner.size(); ++i) sum += (survey[i] - b - M * (scanner[i] - a)).squaredNorm();
  return std::sqrt(sum / static_cast<double>(scanner.size()));
}

Eigen::Matrix3d AdjustedStation::covariance_of(const Eigen::Vector3d& p_scanner) const {
  const Matrix37 A = derivative(orientation, p_scanner);
  return A * covariance * A.transpose();
}

Result<Adjustment> adjust(std::span<const Orientation> start, std::span<const SurveyedPoint> targets,
                          std::span<const CentreObservation> observations,
                          std::span<const std::optional<SurveyedPoint>> station_priors, bool estimate_scale) {
  if (targets.empty() || start.empty()) return Error{ErrorCode::Invalid, "nothing to adjust"};
  // Projected coordinates have seven digits before the point. Subtracting an origin keeps precision in the computation.
  const Eigen::Vector3d origin = targets[0].position_survey;
  Adjustment out;
  out.stations.resize(start.size());
  for (std::size_t s = 0; s < start.size(); ++s) {
    out.stations[s].orientation = start[s];
    out.stations[s].orientation.T_survey_scanner.translation -= origin;
  }
  for (const SurveyedPoint& target : targets) out.targets_survey.push_back(target.position_survey - origin);
  std::vector<std::vector<CentreObservation>> seen(targets.size());
  for (const CentreObservation& one : observations) seen[one.target].push_back(one);

  for (out.steps = 1; out.steps <= 50; ++out.steps) {
    NormalEquations equations(start.size(), estimate_scale);
    for (std::size_t s = 0; s < std::min(start.size(), station_priors.size()); ++s)
      if (const auto& prior = station_priors[s])
        equations.add_prior(s,
                            prior->position_survey - origin - out.stations[s].orientation.T_survey_scanner.translation,
                            prior->sigma_m);
    for (std::size_t k = 0; k < targets.size(); ++k)
      if (!seen[k].empty())
        out.targets_survey[k] =
            equations.add_target(targets[k].position_survey - origin, targets[k].sigma_m, seen[k], out.stations);
    out.chi_squared = equations.chi_squared();
    if (!equations.factorise())
      return Error{ErrorCode::Invalid, "the targets do not determine every station's orientation"};
    const Eigen::VectorXd step = equations.step();
    apply_step(step, estimate_scale, out.stations);
    if (step.cwiseAbs().maxCoeff() < 1e-9 || (out.steps > 8 && step.cwiseAbs().maxCoeff() < 1e-7)) {
      set_covariances(equations.inverse(), estimate_scale, out.stations);
      break;
    }
  }
  if (out.steps > 50)
    return Error{ErrorCode::Invalid,
                 "the adjustment does not converge: the targets found do not fit their surveyed places"};
  out.freedom = static_cast<int>(3 * observations.size()) - static_cast<int>(start.size()) * (estimate_scale ? 7 : 6);
  for (std::size_t s = 0; s < station_priors.size(); ++s) out.freedom += station_priors[s] ? 3 : 0;
  for (AdjustedStation& station : out.stations) station.orientation.T_survey_scanner.translation += origin;
  for (Eigen::Vector3d& place : out.targets_survey) place += origin;
  for (const CentreObservation& one : observations)
    out.residuals_survey.push_back(out.stations[one.station].orientation.survey_from_scanner(one.centre_scanner) -
                                   targets[one.target].position_survey);
  return out;
}

}  // namespace hueline::calibration
