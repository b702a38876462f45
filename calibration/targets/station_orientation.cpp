#include "calibration/targets/station_orientation.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/targets/station_search.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

/// The adjustment of one station, repeated as targets are added and removed.
class StationAdjuster {
 public:
  StationAdjuster(const SurveyedStation& station, std::span<const SurveyedTarget> targets, StationSearch search,
                  const TargetsConfig& config)
      : station_(station), targets_(targets), search_(std::move(search)), config_(config) {
    if (station.sigma_m) prior_ = SurveyedPoint{station.position.xyz, *station.sigma_m};
    orientation_ = search_.result.match->orientation;
    for (std::size_t i = 0; i < search_.targets.size(); ++i) {
      TargetOutcome outcome;
      outcome.target = search_.targets[i];
      outcome.counts = search_.detections[i].counts;
      const auto& chosen = search_.result.match->chosen[i];
      if (chosen) take(outcome, search_.to_match[i].candidates[*chosen]);
      out_.targets.push_back(outcome);
    }
  }

  Result<StationResult> run(std::size_t station) {
    const bool published = config_.method == CentreMethod::LinearFit;
    if (published) {
      for (TargetOutcome& outcome : out_.targets)
        if (outcome.is_found()) refit_published(outcome);
    } else {
      // The matched targets orient the scan. All other targets are then looked for at their predicted places, twice,
      // with a better orientation each time.
      for (int round = 0; round < 2; ++round) {
        if (Status done = adjust_used(round == 0); !done.ok()) return refused(done.error().message);
        for (TargetOutcome& outcome : out_.targets) look_where_predicted(outcome);
      }
    }
    if (Status done = enough(); !done.ok()) return done.error();
    if (Status done = adjust_used(false); !done.ok()) return refused(done.error().message);
    if (!published)
      if (Status done = reject_misfits(); !done.ok()) return done.error();
    if (Status done = certain(); !done.ok()) return done.error();
    out_.station = station;
    out_.points_read = search_.rings.points_read;
    out_.ring_points = search_.rings.points_scanner.size();
    out_.farthest_m = search_.rings.farthest_m;
    for (const RingDetection& detection : search_.detections)
      for (const Candidate& candidate : detection.candidates)
        if (std::ranges::none_of(out_.targets, [&](const TargetOutcome& t) {
              return t.is_found() && (t.centre_scanner - candidate.centre_scanner).norm() < 0.5;
            }))
          out_.others_scanner.push_back(candidate.centre_scanner);
    return std::move(out_);
  }

 private:
  Error refused(const std::string& what) const {
    return {ErrorCode::Invalid, fmt::format("station {}: {}", station_.name, what)};
  }

  Eigen::Matrix3d with_common_range(const Eigen::Vector3d& centre, const Eigen::Matrix3d& covariance) const {
    const Eigen::Vector3d sight = centre.normalized();
    const double common = config_.noise.common_range_sigma_m();
    return covariance + common * common * sight * sight.transpose();
  }

  void take(TargetOutcome& outcome, const Candidate& candidate) const {
    outcome.state = targets_[outcome.target].is_check ? TargetState::Check : TargetState::Used;
    outcome.centre_scanner = candidate.centre_scanner;
    outcome.covariance_scanner = config_.method == CentreMethod::KnownRadius
                                     ? with_common_range(candidate.centre_scanner, candidate.covariance)
                                     : candidate.covariance;
    outcome.points = candidate.points;
    outcome.roundness = candidate.roundness;
  }

  std::vector<Eigen::Vector3f> points_near(const Eigen::Vector3d& centre, double distance) const {
    std::vector<Eigen::Vector3f> near;
    for (const auto& p : search_.rings.points_scanner)
      if ((p.cast<double>() - centre).squaredNorm() <= distance * distance) near.push_back(p);
    return near;
  }

  /// Step 7 as published: fits the sphere in the whole ring with an estimated radius, drops points beyond 2 sigma and
  /// fits again.
  void refit_published(TargetOutcome& outcome) const {
    const double radius = targets_[outcome.target].radius_m;
    std::vector<Eigen::Vector3f> near;
    for (const auto& p : points_near(outcome.centre_scanner, 1.5 * radius))
      if (std::abs((p.cast<double>() - outcome.centre_scanner).norm() - radius) <= 3 * config_.noise.range_precision_m)
        near.push_back(p);
    auto fit = fit_linear(near);
    if (!fit) return;
    std::erase_if(near, [&](const Eigen::Vector3f& p) {
      return std::abs((p.cast<double>() - fit->centre_scanner).norm() - fit->radius) >
             2 * config_.noise.range_precision_m;
    });
    if (const auto again = fit_linear(near)) fit = again;
    outcome.centre_scanner = fit->centre_scanner;
    outcome.points = near.size();
    outcome.roundness = fit->roundness;
  }

  Status adjust_used(bool with_checks) {
    std::vector<CentreObservation> observations;
    std::vector<SurveyedPoint> surveyed;
    std::vector<Eigen::Vector3d> places;
    for (const TargetOutcome& outcome : out_.targets) {
      if (outcome.state != TargetState::Used && !(with_checks && outcome.state == TargetState::Check)) continue;
      const SurveyedTarget& target = targets_[outcome.target];
      observations.push_back({0, surveyed.size(), outcome.centre_scanner, outcome.covariance_scanner});
      surveyed.push_back({target.position.xyz, target.sigma_m});
      places.push_back(target.position.xyz);
    }
    const std::optional<SurveyedPoint> priors[] = {prior_};
    const Orientation start[] = {orientation_};
    auto adjusted = adjust(start, surveyed, observations, priors, config_.estimate_scale);
    if (!adjusted.ok()) return adjusted.error();
    out_.adjusted = adjusted->stations[0];
    orientation_ = out_.adjusted.orientation;
    out_.chi_squared = adjusted->chi_squared;
    out_.freedom = adjusted->freedom;
    out_.spread = spread_of(places);
    return {};
  }

  /// Extends step 7: fits the centre again from the whole ring at the place that the orientation predicts, whether the
  /// target was found before or not.
  void look_where_predicted(TargetOutcome& outcome) const {
    const SurveyedTarget& target = targets_[outcome.target];
    const Orientation& o = orientation_;
    const Eigen::Vector3d predicted =
        o.T_survey_scanner.rotation.conjugate() * (target.position.xyz - o.T_survey_scanner.translation) / o.scale;
    const Eigen::Matrix3d uncertain =
        out_.adjusted.covariance_of(predicted) + target.sigma_m * target.sigma_m * Eigen::Matrix3d::Identity();
    const double doubt = std::min(3 * std::sqrt(uncertain.trace()), target.radius_m);
    const auto near = points_near(predicted, 1.5 * target.radius_m + doubt);
    const Eigen::Matrix3d R = o.T_survey_scanner.rotation.toRotationMatrix();
    const auto misfit = [&](const CentreFit& fit) {
      const Eigen::Vector3d off = o.survey_from_scanner(fit.centre_scanner) - target.position.xyz;
      return off.dot((uncertain + R * with_common_range(fit.centre_scanner, fit.covariance) * R.transpose()).inverse() *
                     off);
    };
    auto fit = fit_known_radius(near, target.radius_m, predicted, config_.noise);
    bool agrees = fit && misfit(*fit) <= limit();
    if (!agrees) {
      // Few points can fit two centres. This tests whether one of them is at the predicted place.
      const auto again = fit_known_radius_near(near, target.radius_m,
                                               {predicted, with_common_range(predicted, R.transpose() * uncertain * R)},
                                               config_.noise);
      if (again && again->chi_squared <= noise_limit(static_cast<double>(again->points)) &&
          (!fit || 2 * again->points > fit->points)) {
        fit = again;
        agrees = true;
      }
    }
    if (!agrees && outcome.is_found()) return;  // reject_misfits() decides about a target that was matched before
    if (agrees && fit) {
      take(outcome, {fit->centre_scanner, fit->covariance, fit->points, fit->roundness});
      outcome.chi_squared = fit->chi_squared;
      outcome.reason.clear();
      return;
    }
    const auto on_it = static_cast<std::size_t>(std::ranges::count_if(near, [&](const auto& p) {
      return (p.template cast<double>() - predicted).norm() < 1.2 * target.radius_m + doubt;
    }));
    outcome.state = on_it < kFewestOnTarget ? TargetState::NotSeen : TargetState::Rejected;
    if (on_it < kFewestOnTarget)
      outcome.reason =
          fmt::format("{} points are at the expected place, and at least {} are needed", on_it, kFewestOnTarget);
    else if (!fit)
      outcome.reason =
          fmt::format("{} points are at the expected place, but they are no sphere of the target's radius", on_it);
    else
      outcome.reason =
          fmt::format("a sphere is {:.0f} mm from the expected place: the target was moved, or wrongly surveyed",
                      (o.survey_from_scanner(fit->centre_scanner) - target.position.xyz).norm() * 1000);
  }

  /// Returns the limit of chi-squared of three coordinates.
  double limit() const { return (config_.gate_sigma + 0.5) * (config_.gate_sigma + 0.5); }

  std::vector<TargetOutcome*> used() {
    std::vector<TargetOutcome*> out;
    for (TargetOutcome& outcome : out_.targets)
      if (outcome.state == TargetState::Used) out.push_back(&outcome);
    return out;
  }

  /// Removes the target that disagrees most with the place that all others give, one after the other, while four or
  /// more remain.
  Status reject_misfits() {
    for (;;) {
      const auto all = used();
      if (all.size() < 4) break;
      double worst = limit();
      TargetOutcome* misfit = nullptr;
      double off_by = 0;
      for (TargetOutcome* one : all) {
        one->state = TargetState::Rejected;
        const bool done = adjust_used(false).ok();
        one->state = TargetState::Used;
        if (!done) continue;
        const auto [off, sigma] = against_survey(*one);
        const double misfit_here = off.dot(sigma.inverse() * off);
        if (misfit_here <= worst) continue;
        worst = misfit_here;
        misfit = one;
        off_by = off.norm();
      }
      if (misfit != nullptr) {
        misfit->state = TargetState::Rejected;
        misfit->reason = fmt::format(
            "it is {:.0f} mm from the place that the other targets give: it was moved, wrongly surveyed, or is another "
            "sphere",
            off_by * 1000);
      }
      if (Status done = adjust_used(false); !done.ok()) return refused(done.error().message);
      if (misfit == nullptr) break;
    }
    if (used().size() == 3 && out_.freedom > 0 && out_.chi_squared > limit())
      return refused(
          fmt::format("its 3 targets do not fit each other: chi-squared {:.1f} with {} degrees of freedom; one was "
                      "moved or wrongly surveyed, and a fourth would tell which",
                      out_.chi_squared, out_.freedom));
    for (TargetOutcome& outcome : out_.targets) {
      if (outcome.state == TargetState::Rejected || outcome.state == TargetState::NotSeen) continue;
      const auto [off, sigma] = against_survey(outcome);
      outcome.residual_survey = off;
      if (outcome.state != TargetState::Check || off.dot(sigma.inverse() * off) <= limit()) continue;
      outcome.state = TargetState::Rejected;
      outcome.reason =
          fmt::format("it is {:.0f} mm from the place that the targets of the orientation give", off.norm() * 1000);
    }
    return {};
  }

  /// Returns scan minus survey and its covariance for a target that is not part of the orientation.
  std::pair<Eigen::Vector3d, Eigen::Matrix3d> against_survey(const TargetOutcome& outcome) const {
    const SurveyedTarget& target = targets_[outcome.target];
    const Eigen::Matrix3d R = out_.adjusted.orientation.T_survey_scanner.rotation.toRotationMatrix();
    return {out_.adjusted.orientation.survey_from_scanner(outcome.centre_scanner) - target.position.xyz,
            out_.adjusted.covariance_of(outcome.centre_scanner) + R * outcome.covariance_scanner * R.transpose() +
                target.sigma_m * target.sigma_m * Eigen::Matrix3d::Identity()};
  }

  Status enough() {
    const auto all = used();
    if (all.size() < 3) {
      std::string why;
      for (const TargetOutcome& outcome : out_.targets)
        if (!outcome.reason.empty()) why += fmt::format("; {}: {}", targets_[outcome.target].name, outcome.reason);
      return refused(fmt::format("{} targets found to orient by, at least 3 are needed{}", all.size(), why));
    }
    return {};
  }

  /// Tests whether the orientation is certain enough. A good fit is no proof, because targets near a line leave the
  /// rotation about that line undetermined. The test is how far the sigma of the rotation moves the targets themselves,
  /// which suits a field of any size: with well spread targets it is about the sigma of one centre.
  Status certain() {
    const Eigen::Matrix3d turn = out_.adjusted.covariance.topLeftCorner<3, 3>();
    const double sigma = std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turn).eigenvalues().maxCoeff());
    const auto [lever, centre_sigma] = field();
    const bool is_on_a_line = out_.spread < config_.least_spread && !prior_;
    const bool is_vague = sigma * kDegPerRad > config_.most_rotation_sigma_deg &&
                          sigma * lever > config_.most_turn_over_centre * centre_sigma;
    if (is_on_a_line || is_vague)
      return refused(
          fmt::format("the {} targets found are too near one line (width {:.1f} % of the length): the rotation about "
                      "this line is only known to {:.4f} degrees, which moves the outermost target by {:.0f} mm, while "
                      "the centres are known to {:.1f} mm; allowed: a width of {:.1f} %, and {} degrees or {} times a "
                      "centre's sigma. Set one target well aside from the others",
                      used().size(), out_.spread * 100, sigma * kDegPerRad, sigma * lever * 1000, centre_sigma * 1000,
                      config_.least_spread * 100, config_.most_rotation_sigma_deg, config_.most_turn_over_centre));
    return {};
  }

  struct Field {
    double lever_m = 0;  ///< distance from the middle of the points that determine the orientation to the outermost one
    double centre_sigma_m =
        0;  ///< root mean square of the centres' sigmas in their worst direction, with the survey's sigma
  };
  Field field() {
    std::vector<Eigen::Vector3d> places;
    double squares = 0;
    for (const TargetOutcome* outcome : used()) {
      const SurveyedTarget& target = targets_[outcome->target];
      places.push_back(target.position.xyz);
      squares += Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(outcome->covariance_scanner).eigenvalues().maxCoeff() +
                 target.sigma_m * target.sigma_m;
    }
    const double sigma = std::sqrt(squares / static_cast<double>(places.size()));
    if (prior_) places.push_back(prior_->position_survey);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& p : places) middle += p / static_cast<double>(places.size());
    double lever = 0;
    for (const auto& p : places) lever = std::max(lever, (p - middle).norm());
    return {lever, sigma};
  }

  const SurveyedStation& station_;
  std::span<const SurveyedTarget> targets_;
  StationSearch search_;
  const TargetsConfig& config_;
  std::optional<SurveyedPoint> prior_;
  Orientation orientation_;
  StationResult out_;
};

/// Computes the residuals and their sigmas with the orientation of `result`.
void fill_residuals(StationResult& result, std::span<const SurveyedTarget> targets) {
  const Eigen::Matrix3d R = result.adjusted.orientation.T_survey_scanner.rotation.toRotationMatrix();
  for (TargetOutcome& outcome : result.targets) {
    if (!outcome.is_found()) continue;
    const SurveyedTarget& target = targets[outcome.target];
    outcome.residual_survey =
        result.adjusted.orientation.survey_from_scanner(outcome.centre_scanner) - target.position.xyz;
    Eigen::Matrix3d covariance =
        R * outcome.covariance_scanner * R.transpose() + target.sigma_m * target.sigma_m * Eigen::Matrix3d::Identity();
    if (outcome.state == TargetState::Check) covariance += result.adjusted.covariance_of(outcome.centre_scanner);
    outcome.residual_sigma = covariance.diagonal().cwiseSqrt();
  }
}

}  // namespace

const char* name(TargetState state) {
  switch (state) {
    case TargetState::Used:
      return "Used";
    case TargetState::Check:
      return "Check";
    case TargetState::NotSeen:
      return "NotSeen";
    case TargetState::Rejected:
      return "Rejected";
  }
  return "?";
}

std::string TargetsConfig::validate() const {
  if (std::string wrong = noise.validate(); !wrong.empty()) return wrong;
  if (std::string wrong = detection.validate(); !wrong.empty()) return wrong;
  if (!(station_doubt_m >= 0 && station_doubt_m <= 5))
    return fmt::format("station_doubt_m is {}; allowed: 0 to 5", station_doubt_m);
  if (!(most_tilt_deg > 0 && most_tilt_deg <= 180))
    return fmt::format("most_tilt_deg is {}; allowed: above 0, up to 180", most_tilt_deg);
  if (!(least_spread >= 0 && least_spread < 1)) return fmt::format("least_spread is {}; allowed: 0 to 1", least_spread);
  if (!(most_rotation_sigma_deg > 0))
    return fmt::format("most_rotation_sigma_deg is {}; allowed: above 0", most_rotation_sigma_deg);
  if (!(most_turn_over_centre >= 1))
    return fmt::format("most_turn_over_centre is {}; allowed: 1 or more", most_turn_over_centre);
  if (!(gate_sigma >= 2 && gate_sigma <= 10)) return fmt::format("gate_sigma is {}; allowed: 2 to 10", gate_sigma);
  if (threads < 1 || threads > 256) return fmt::format("threads is {}; allowed: 1 to 256", threads);
  return {};
}

Result<StationResult> orient_station(const ScanBlocks& scan, std::span<const SurveyedStation> stations,
                                     std::size_t station, std::span<const SurveyedTarget> targets,
                                     const TargetsConfig& config) {
  const SurveyedStation& here = stations[station];
  std::vector<Eigen::Vector3d> places;
  for (const std::size_t i : targets_of(here, targets))
    if (!targets[i].is_check) places.push_back(targets[i].position.xyz);
  const auto refused = [&](const std::string& what) {
    return Error{ErrorCode::Invalid, "station " + here.name + ": " + what};
  };
  if (places.size() < 3)
    return refused(
        fmt::format("{} surveyed targets to orient by; at least 3 are needed, not on one line: survey more, or let a "
                    "check target take part",
                    places.size()));
  if (spread_of(places) < config.least_spread && !here.sigma_m)
    return refused(
        fmt::format("its {} targets are too near one line (width {:.1f} % of the length, allowed {:.1f} %): the "
                    "rotation about this line cannot be determined. Set one target well aside, or give the station's "
                    "own sigma_m so that its place counts",
                    places.size(), spread_of(places) * 100, config.least_spread * 100));
  auto search = search_station(scan, here, targets, config);
  if (!search.ok()) return search.error();
  if (!search->result.match) return refusal(scan, stations, station, targets, *search, config);
  auto result = StationAdjuster(here, targets, std::move(search).value(), config).run(station);
  if (result.ok()) fill_residuals(*result, targets);
  return result;
}

Status adjust_together(std::span<StationResult> results, std::span<const SurveyedStation> stations,
                       std::span<const SurveyedTarget> targets, const TargetsConfig& config) {
  std::vector<Orientation> start;
  std::vector<CentreObservation> observations;
  std::vector<SurveyedPoint> surveyed;
  std::vector<std::optional<SurveyedPoint>> priors;
  for (const SurveyedTarget& target : targets) surveyed.push_back({target.position.xyz, target.sigma_m});
  for (std::size_t s = 0; s < results.size(); ++s) {
    const SurveyedStation& station = stations[results[s].station];
    start.push_back(results[s].adjusted.orientation);
    priors.push_back(station.sigma_m ? std::optional(SurveyedPoint{station.position.xyz, *station.sigma_m})
                                     : std::nullopt);
    for (const TargetOutcome& outcome : results[s].targets)
      if (outcome.state == TargetState::Used)
        observations.push_back({s, outcome.target, outcome.centre_scanner, outcome.covariance_scanner});
  }
  auto adjusted = adjust(start, surveyed, observations, priors, config.estimate_scale);
  if (!adjusted.ok()) return adjusted.error();
  for (std::size_t s = 0; s < results.size(); ++s) {
    results[s].adjusted = adjusted->stations[s];
    fill_residuals(results[s], targets);
  }
  return {};
}

}  // namespace hueline::calibration
