#include "calibration/boresight/boresight.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "calibration/boresight/boresight_normals.hpp"
#include "calibration/boresight/mount_covariance.hpp"
#include "core/angle.hpp"
#include "core/median.hpp"

namespace hueline::calibration {
namespace {

constexpr double kTurnBefore = 3 * kRadPerDeg;  // one sigma of a rotation before the estimation: hardly any information
constexpr double kHeld_m = 1e-7;                // one sigma of a value that must not move

struct Level {
  double voxel_m, gate_m;
  std::size_t patches, returns;  // most patches, and most returns of a patch
};
/// One degree is half a metre at 30 m, and two opposite passes see it with opposite signs.
constexpr Level kLevels[] = {{3, 0.4, 2500, 60}, {3, 0.2, 2500, 60}, {2, 0.1, 2500, 60}, {1.5, 0.06, 2500, 60}};
constexpr Level kFinest{1, 0.03, 1'000'000, 1'000'000};
constexpr int kStepsOfLevel = 2, kMostFinest = 10;
// Rounds at the finest level that look for patches again. Later rounds keep the patches until nothing moves, because a
// few patches always appear and disappear at the limits of the gates.
constexpr int kSearches = 5;

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd turn(q);
  return turn.axis() * std::remainder(turn.angle(), 2 * std::numbers::pi);
}

class Estimation {
 public:
  Estimation(const BoresightDrive& drive, const BoresightConfig& config, TrajectoryCorrection trajectory)
      : drive_(drive),
        config_(config),
        state_{{}, std::move(trajectory)},
        scanners_(drive.scanners.size()),
        mounts_(static_cast<Eigen::Index>(6 * scanners_)) {
    for (const auto& scanner : drive.scanners) state_.mounts.push_back(scanner.T_body_scanner);
    unit_.assign(scanners_, 1);
    held_.assign(static_cast<std::size_t>(mounts_), false);
  }

  Result<Boresight> run();

 private:
  Status search(const Level& level);
  Status round(const Level& level, bool is_finest, bool searches);
  Vector6d information_before(std::size_t scanner, bool with_held) const;
  void step(const Level& level, bool is_finest);
  Eigen::MatrixXd covariance() const;
  Status judge() const;
  Boresight result() const;

  const BoresightDrive& drive_;
  const BoresightConfig& config_;
  BoresightState state_;
  const std::size_t scanners_;
  const Eigen::Index mounts_;
  std::vector<double> unit_;
  std::vector<bool> held_;
  std::vector<Patch> patches_;
  BoresightNormals last_;
  Eigen::VectorXd moved_;  // change of the mountings in the last round
  Boresight out_;
};

Status Estimation::search(const Level& level) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(drive_.returns.size());
  for (const BoresightReturn& one : drive_.returns) points.push_back(place_return(one, state_));
  PatchConfig wanted;
  wanted.voxel_m = level.voxel_m;
  wanted.gate_m = level.gate_m;
  wanted.flatness = std::max(0.05, 2 * std::pow(level.gate_m / (0.3 * level.voxel_m), 2));
  wanted.most_patches = std::min(level.patches, config_.most_patches);
  wanted.most_returns = std::min(level.returns, config_.most_of_patch);
  PatchesFound found = find_patches(drive_, points, wanted);
  patches_ = std::move(found.patches);
  if (found.seen_twice == 0)
    return Error{ErrorCode::Unavailable,
                 fmt::format("one pass only: none of the {} places with enough returns was seen in two passes; drive "
                             "the same street again in the other direction",
                             found.seen_once)};
  if (patches_.size() < config_.fewest_patches)
    return Error{
        ErrorCode::Unavailable,
        fmt::format("{} flat places were seen in two passes, and {} are needed: the passes hardly overlap, or there is "
                    "little but leaves and grass; drive along buildings in both directions, less than 30 m away",
                    patches_.size(), config_.fewest_patches)};
  return {};
}

/// Looks for planes if `searches`, then makes steps of the estimation towards them.
Status Estimation::round(const Level& level, bool is_finest, bool searches) {
  ++out_.rounds;
  if (searches)
    if (Status done = search(level); !done.ok()) return done;
  moved_ = Eigen::VectorXd::Zero(mounts_);
  for (int i = 0; i < kStepsOfLevel; ++i) {
    step(level, is_finest);
    for (std::size_t s = 0; s < scanners_; ++s) {
      const auto& T = state_.mounts[s];
      const auto& T_start = drive_.scanners[s].T_body_scanner;
      if (!(T.rotation.angularDistance(T_start.rotation) < config_.farthest_deg * kRadPerDeg &&
            (T.translation - T_start.translation).norm() < config_.farthest_m))
        return Error{
            ErrorCode::Unavailable,
            fmt::format(
                "the planes move scanner {} farther than {} deg or {} m from its mounting in the rig: the mounting, or "
                "the axes in which it was measured, are wrong by more than this calibration can find; measure it again",
                drive_.scanners[s].name, config_.farthest_deg, config_.farthest_m)};
    }
  }
  return {};
}

Vector6d Estimation::information_before(std::size_t scanner, bool with_held) const {
  Vector6d out;
  for (std::size_t i = 0; i < 6; ++i) {
    const double sigma = i < 3 ? kTurnBefore : with_held && held_[6 * scanner + i] ? kHeld_m : config_.sigma_lever_m;
    out[static_cast<Eigen::Index>(i)] = 1 / (sigma * sigma);
  }
  return out;
}

/// Makes one Gauss-Newton step.
void Estimation::step(const Level& level, bool is_finest) {
  BoresightWeights weights;
  weights.unit = unit_;
  if (!is_finest) weights.gate_m = level.gate_m;
  last_ = boresight_normals(drive_, patches_, state_, weights);
  if (is_finest)
    for (std::size_t s = 0; s < scanners_; ++s)
      if (last_.off[s].size() > 30) unit_[s] *= std::clamp(median(last_.off[s]) / 0.6745, 0.2, 5.0);
  Eigen::MatrixXd information = last_.information;
  Eigen::VectorXd gradient = last_.gradient;
  state_.trajectory.add_prior(information, gradient, mounts_);
  for (std::size_t s = 0; s < scanners_; ++s) {
    const auto& T = state_.mounts[s];
    const auto& T_before = drive_.scanners[s].T_body_scanner;
    Vector6d off;
    off << rotation_vector(T.rotation * T_before.rotation.conjugate()), T.translation - T_before.translation;
    const Vector6d before = information_before(s, true);
    const auto at = static_cast<Eigen::Index>(6 * s);
    information.diagonal().segment<6>(at) += before;
    gradient.segment<6>(at) += before.cwiseProduct(off);
  }
  const Eigen::VectorXd by = -information.llt().solve(gradient);
  for (std::size_t s = 0; s < scanners_; ++s) {
    const Vector6d of = by.segment<6>(static_cast<Eigen::Index>(6 * s));
    auto& T = state_.mounts[s];
    const double angle = of.head<3>().norm();
    if (angle > 0)
      T.rotation = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, of.head<3>() / angle)) * T.rotation).normalized();
    T.translation += of.tail<3>();
  }
  state_.trajectory.move(by.tail(by.size() - mounts_));
  moved_ += by.head(mounts_);
}

Eigen::MatrixXd Estimation::covariance() const {
  Eigen::MatrixXd information = mount_information(last_, state_.trajectory);
  for (std::size_t s = 0; s < scanners_; ++s)
    information.diagonal().segment<6>(static_cast<Eigen::Index>(6 * s)) += information_before(s, false);
  return covariance_with_held(information, held_, config_.sigma_lever_m);
}

/// Returns an error unless the planes determine every rotation.
Status Estimation::judge() const {
  const Eigen::MatrixXd C = covariance();
  if (last_.patches < config_.fewest_patches)
    return Error{ErrorCode::Unavailable,
                 fmt::format("{} of {} flat places agree in two passes, and {} are needed: objects have moved between "
                             "the passes, or the rig is wrong by more than a degree or a decimetre",
                             last_.patches, patches_.size(), config_.fewest_patches)};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> faced(last_.normals / static_cast<double>(last_.patches));
  for (std::size_t s = 0; s < scanners_; ++s) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turn(
        C.block<3, 3>(static_cast<Eigen::Index>(6 * s), static_cast<Eigen::Index>(6 * s)));
    const double weakest = std::sqrt(turn.eigenvalues()[2]) / kRadPerDeg;
    if (last_.of_scanner[s] > 0 && weakest < config_.weakest_turn_deg) continue;
    const Eigen::Vector3d axis = turn.eigenvectors().col(2);
    constexpr const char* kAbout[] = {"right (pitch)", "forward (roll)", "upward (heading)"};
    Eigen::Index most = 0;
    axis.cwiseAbs().maxCoeff(&most);
    const std::string why = faced.eigenvalues()[1] < 0.02 ? "all planes face one direction; drive where there are "
                                                            "walls beside the road and open ground in front of them"
                            : last_.of_scanner[s] == 0
                                ? "none of its returns lies on a plane seen twice"
                                : "too few planes have a direction that shows this rotation, or the passes are too "
                                  "short; drive longer, in both directions, along walls of several directions";
    return Error{
        ErrorCode::Unavailable,
        fmt::format("scanner {}: the rotation about the vehicle's axis {} is uncertain by {:.2f} deg ({} allowed): {}",
                    drive_.scanners[s].name, kAbout[most], weakest, config_.weakest_turn_deg, why)};
  }
  return {};
}

Boresight Estimation::result() const {
  Boresight out = out_;
  out.covariance = covariance();
  Eigen::MatrixXd alone = last_.without_pos;
  for (std::size_t s = 0; s < scanners_; ++s)
    alone.diagonal().segment<6>(static_cast<Eigen::Index>(6 * s)) += information_before(s, true);
  alone = alone.llt().solve(Eigen::MatrixXd::Identity(mounts_, mounts_)).eval();
  out.patches = last_.patches;
  out.returns = last_.returns;
  out.facing = last_.facing;
  out.rms_m = std::sqrt(last_.squares / static_cast<double>(std::max<std::size_t>(1, last_.returns)));
  for (std::size_t s = 0; s < scanners_; ++s) {
    ScannerBoresight one = out_.scanners[s];
    const auto& before = drive_.scanners[s].T_body_scanner;
    one.T_body_scanner = state_.mounts[s];
    one.boresight_rotation = rotation_vector(before.rotation.conjugate() * one.T_body_scanner.rotation);
    one.lever_moved_m = one.T_body_scanner.translation - before.translation;
    for (std::size_t i = 0; i < 6; ++i) {
      const auto at = static_cast<Eigen::Index>(6 * s + i);
      one.sigma[i] = std::sqrt(out.covariance(at, at));
      one.sigma_without_pos[i] = std::sqrt(alone(at, at));
    }
    one.returns = last_.of_scanner[s];
    one.unit_sigma = unit_[s];
    out.scanners[s] = one;
  }
  return out;
}

Result<Boresight> Estimation::run() {
  const auto tell = [&](double share) {
    if (config_.progress) config_.progress("looking for planes seen twice", share);
  };
  constexpr double kRounds = std::size(kLevels) + kMostFinest;
  for (const Level& level : kLevels) {
    tell(out_.rounds / kRounds);
    if (Status done = round(level, false, true); !done.ok()) return done.error();
  }
  bool is_judged = false;
  for (int i = 0; i < kMostFinest && !out_.is_settled; ++i) {
    tell(out_.rounds / kRounds);
    if (Status done = round(kFinest, true, i < kSearches); !done.ok()) return done.error();
    const Eigen::MatrixXd C = covariance();
    out_.is_settled = is_judged;
    for (Eigen::Index at = 0; at < mounts_; ++at) out_.is_settled &= std::abs(moved_[at]) < 0.1 * std::sqrt(C(at, at));
    if (is_judged || i == 0) continue;
    // The patches are final enough to judge each parameter by them. A value that the data hardly determine is held as
    // measured.
    if (Status fine = judge(); !fine.ok()) return fine.error();
    is_judged = true;
    out_.scanners.resize(scanners_);
    for (std::size_t s = 0; s < scanners_; ++s) {
      const Vector6d before = information_before(s, false);
      out_.scanners[s].name = drive_.scanners[s].name;
      for (std::size_t k = 0; k < 6; ++k) {
        const auto at = static_cast<Eigen::Index>(6 * s + k);
        out_.scanners[s].share[k] = std::clamp(1 - C(at, at) * before[static_cast<Eigen::Index>(k)], 0.0, 1.0);
        out_.scanners[s].is_determined[k] = k < 3 || out_.scanners[s].share[k] >= config_.least_share;
        held_[6 * s + k] = !out_.scanners[s].is_determined[k];
      }
    }
  }
  tell(1);
  if (Status fine = judge(); !fine.ok()) return fine.error();
  return result();
}

}  // namespace

std::string BoresightConfig::validate() const {
  if (!(sigma_lever_m >= 1e-4 && sigma_lever_m <= 1))
    return fmt::format("sigma_lever_m is {}; allowed: 0.0001 to 1 m", sigma_lever_m);
  if (!(correlation_s >= 1 && correlation_s <= 1e5))
    return fmt::format("correlation_s is {}; allowed: 1 to 100000 s", correlation_s);
  if (!(knot_s >= 0.5 && knot_s <= 100)) return fmt::format("knot_s is {}; allowed: 0.5 to 100 s", knot_s);
  if (!(least_share >= 0 && least_share <= 1)) return fmt::format("least_share is {}; allowed: 0 to 1", least_share);
  if (!(weakest_turn_deg > 0 && weakest_turn_deg <= 1))
    return fmt::format("weakest_turn_deg is {}; allowed: above 0 to 1 deg", weakest_turn_deg);
  if (fewest_patches < 10) return fmt::format("fewest_patches is {}; allowed: 10 or more", fewest_patches);
  if (most_patches < fewest_patches)
    return fmt::format("most_patches is {}; allowed: {} (fewest_patches) or more", most_patches, fewest_patches);
  if (most_of_patch < 12) return fmt::format("most_of_patch is {}; allowed: 12 or more", most_of_patch);
  if (!(farthest_deg > 0 && farthest_deg <= 10 && farthest_m > 0 && farthest_m <= 5))
    return fmt::format("farthest_deg and farthest_m are {} and {}; allowed: to 10 deg and 5 m", farthest_deg,
                       farthest_m);
  return {};
}

Result<Boresight> find_boresight(const BoresightDrive& drive, const BoresightConfig& config) {
  if (const std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (drive.scanners.empty())
    return Error{ErrorCode::Unavailable, "the rig has no laser scanner: there is nothing to calibrate"};
  if (drive.returns.empty())
    return Error{
        ErrorCode::Unavailable,
        "no laser return of the drive has a pose: check that the laser and the POS were running and synchronised"};
  float end = 0;
  for (const BoresightReturn& one : drive.returns) end = std::max(end, one.time_s);
  return Estimation(drive, config,
                    TrajectoryCorrection(drive.sigmas, static_cast<double>(end), {config.knot_s, config.correlation_s}))
      .run();
}

}  // namespace hueline::calibration
