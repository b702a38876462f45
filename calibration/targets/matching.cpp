#include "calibration/targets/matching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hueline::calibration {
namespace {

/// One candidate of one target.
struct Node {
  std::size_t target, candidate;
  Eigen::Vector3d centre;
  Eigen::Matrix3d covariance;
};

std::vector<Node> nodes_of(std::span<const TargetToMatch> targets, const MatchingConfig& config) {
  std::vector<Node> nodes;
  for (std::size_t t = 0; t < targets.size(); ++t)
    for (std::size_t c = 0; c < targets[t].candidates.size(); ++c) {
      const Candidate& candidate = targets[t].candidates[c];
      const Eigen::Vector3d sight = candidate.centre_scanner.normalized();
      nodes.push_back({t, c, candidate.centre_scanner,
                       candidate.covariance +
                           config.common_range_sigma_m * config.common_range_sigma_m * sight * sight.transpose()});
    }
  return nodes;
}

/// Returns the squared difference between the found and the surveyed distance, over its variance.
double mismatch(const Node& a, const Node& b, std::span<const TargetToMatch> targets) {
  const Eigen::Vector3d apart = a.centre - b.centre;
  const double found = apart.norm();
  if (found < 1e-6) return 1e9;
  const SurveyedPoint &A = targets[a.target].surveyed, &B = targets[b.target].surveyed;
  const double off = found - (A.position_survey - B.position_survey).norm();
  const Eigen::Vector3d along = apart / found;
  return off * off / (along.dot((a.covariance + b.covariance) * along) + A.sigma_m * A.sigma_m + B.sigma_m * B.sigma_m);
}

/// Searches for sets of nodes that are all connected with each other, largest first. It is a depth-first search over
/// the targets in their order.
class CliqueSearch {
 public:
  CliqueSearch(std::span<const TargetToMatch> targets, const MatchingConfig& config)
      : targets_(targets), config_(config), nodes_(nodes_of(targets, config)) {
    const std::size_t n = nodes_.size();
    words_ = (n + 63) / 64;
    joined_.assign(n * words_, 0);
    const double gate = config.gate_sigma * config.gate_sigma;
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = a + 1; b < n; ++b)
        if (nodes_[a].target != nodes_[b].target && mismatch(nodes_[a], nodes_[b], targets_) <= gate) {
          joined_[a * words_ + b / 64] |= 1ull << (b % 64);
          joined_[b * words_ + a / 64] |= 1ull << (a % 64);
        }
  }

  MatchResult run() {
    std::vector<std::uint64_t> all(words_, ~0ull);
    std::vector<std::size_t> chosen;
    extend(0, all, chosen);
    if (steps_ > config_.most_steps) {
      result_.match.reset();
      result_.failure.reason =
          "too many round objects have the same distances from each other as the targets: the search for the targets "
          "was stopped";
      return std::move(result_);
    }
    if (is_ambiguous_) {
      result_.match.reset();
      result_.failure.reason = fmt::format(
          "two different sets of {} spheres fit the surveyed distances equally well: survey one more target",
          result_.failure.best);
    } else if (!result_.match) {
      result_.failure.reason =
          !turned_.empty()
              ? turned_
              : fmt::format("only {} of the {} targets have spheres at the surveyed mutual distances, and 3 are needed",
                            best_any_, targets_.size());
    }
    return std::move(result_);
  }

 private:
  bool joined(std::size_t a, std::size_t b) const { return joined_[a * words_ + b / 64] >> (b % 64) & 1; }

  /// Extends a set by the remaining targets. `open` has the nodes that are connected with all chosen ones.
  void extend(std::size_t target, const std::vector<std::uint64_t>& open, std::vector<std::size_t>& chosen) {
    if (++steps_ > config_.most_steps) return;
    const std::size_t least = result_.match ? result_.match->matched : 3;
    if (target == targets_.size()) {
      best_any_ = std::max(best_any_, chosen.size());
      if (chosen.size() >= least) judge(chosen);
      return;
    }
    // Counts how many targets can still be added at most.
    std::size_t possible = chosen.size();
    std::size_t last = static_cast<std::size_t>(-1);
    for (std::size_t i = first_of(target); i < nodes_.size(); ++i)
      if (nodes_[i].target != last && (open[i / 64] >> (i % 64) & 1)) {
        last = nodes_[i].target;
        ++possible;
      }
    best_any_ = std::max(best_any_, chosen.size());
    if (possible < least) return;
    std::vector<std::uint64_t> narrowed(words_);
    for (std::size_t i = first_of(target); i < nodes_.size() && nodes_[i].target == target; ++i) {
      if (!(open[i / 64] >> (i % 64) & 1)) continue;
      for (std::size_t w = 0; w < words_; ++w) narrowed[w] = open[w] & joined_[i * words_ + w];
      chosen.push_back(i);
      extend(target + 1, narrowed, chosen);
      chosen.pop_back();
    }
    extend(target + 1, open, chosen);
  }

  std::size_t first_of(std::size_t target) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(nodes_, target, {}, &Node::target) - nodes_.begin());
  }

  /// Tests whether a set can be the targets, and whether it is the best so far.
  void judge(const std::vector<std::size_t>& chosen) {
    std::vector<Eigen::Vector3d> scanner, survey;
    double chi_squared = 0;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      scanner.push_back(nodes_[chosen[i]].centre);
      survey.push_back(targets_[nodes_[chosen[i]].target].surveyed.position_survey);
      for (std::size_t k = 0; k < i; ++k) chi_squared += mismatch(nodes_[chosen[i]], nodes_[chosen[k]], targets_);
    }
    const auto orientation = orient_closed_form(scanner, survey);
    if (!orientation) return;
    double rest = 0;
    for (std::size_t i = 0; i < scanner.size(); ++i)
      rest += (orientation->survey_from_scanner(scanner[i]) - survey[i]).squaredNorm();
    rest = std::sqrt(rest / static_cast<double>(scanner.size()));
    const double tilt =
        std::acos(std::clamp((orientation->T_survey_scanner.rotation * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
    const double off_station = (orientation->T_survey_scanner.translation - config_.station_survey).norm();
    const double mirrored = mirrored_rms(scanner, survey);
    // A mirror image has the same distances, so that distances alone do not distinguish left from right.
    const double limit = 0.05;
    if (rest > limit || tilt > config_.most_tilt_rad || off_station > config_.station_doubt_m) {
      if (chosen.size() < turned_size_) return;
      turned_size_ = chosen.size();
      if (rest > limit && mirrored < limit)
        turned_ = fmt::format(
            "the mutual distances of {} targets agree, but only as a mirror image: two axes are swapped or one is "
            "reversed, in the targets' coordinates (east_m "
            "against north_m?) or in the scan",
            chosen.size());
      else if (tilt > config_.most_tilt_rad)
        turned_ = fmt::format(
            "the mutual distances of {} targets agree, but only with the scanner tilted by {:.0f} degrees: axes are "
            "swapped in the targets' coordinates or in "
            "the scan; if the scanner really stood so, allow that tilt",
            chosen.size(), tilt * 57.29577951308232);
      else if (rest <= limit)
        turned_ = fmt::format(
            "the mutual distances of {} targets agree, but they put the scanner {:.2f} m from its surveyed station: is "
            "it another station's scan, or its height?",
            chosen.size(), off_station);
      return;
    }
    if (result_.match && chosen.size() == result_.match->matched) {
      const bool is_as_good = std::abs(chi_squared - result_.match->chi_squared) < 12;
      const bool is_elsewhere = (orientation->T_survey_scanner.rotation.angularDistance(
                                    result_.match->orientation.T_survey_scanner.rotation)) > 0.01;
      if (chi_squared >= result_.match->chi_squared) {
        is_ambiguous_ = is_ambiguous_ || (is_as_good && is_elsewhere);
        return;
      }
      is_ambiguous_ = is_as_good && is_elsewhere;
    } else {
      is_ambiguous_ = false;
    }
    Match match;
    match.chosen.resize(targets_.size());
    for (const std::size_t i : chosen) match.chosen[nodes_[i].target] = nodes_[i].candidate;
    match.matched = chosen.size();
    match.chi_squared = chi_squared;
    match.orientation = *orientation;
    result_.match = std::move(match);
    result_.failure.best = chosen.size();
  }

  std::span<const TargetToMatch> targets_;
  const MatchingConfig& config_;
  std::vector<Node> nodes_;
  std::size_t words_ = 0;
  std::vector<std::uint64_t> joined_;
  MatchResult result_;
  std::string turned_;
  std::size_t turned_size_ = 0, best_any_ = 0, steps_ = 0;
  bool is_ambiguous_ = false;
};

}  // namespace

MatchResult match_by_distances(std::span<const TargetToMatch> targets, const MatchingConfig& config) {
  return CliqueSearch(targets, config).run();
}

std::vector<std::optional<std::size_t>> match_by_share(std::span<const TargetToMatch> targets,
                                                       const MatchingConfig& config) {
  const std::vector<Node> nodes = nodes_of(targets, config);
  const double gate = config.gate_sigma * config.gate_sigma;
  std::vector<std::optional<std::size_t>> chosen(targets.size());
  for (const Node& node : nodes) {
    std::size_t meets = 0;
    for (std::size_t other = 0; other < targets.size(); ++other)
      meets += other != node.target && std::ranges::any_of(nodes, [&](const Node& there) {
                 return there.target == other && mismatch(node, there, targets) <= gate;
               });
    if (2 * meets < targets.size() - 1) continue;
    auto& best = chosen[node.target];
    if (!best ||
        targets[node.target].candidates[node.candidate].roundness > targets[node.target].candidates[*best].roundness)
      best = node.candidate;
  }
  return chosen;
}

}  // namespace hueline::calibration
