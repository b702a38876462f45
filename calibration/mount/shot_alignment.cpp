#include "calibration/mount/shot_alignment.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "calibration/mount/shot_pairs.hpp"
#include "calibration/mount/shot_score.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr std::size_t kFewestPairs = 500, kFewestShotOutlines = 100;
constexpr double kWidest = 0.6 * kRadPerDeg, kMiddle = 0.3 * kRadPerDeg;  // blurs of the search
constexpr double kFinestBlur = 0.5;                                       // the last blur, in steps of the laser
constexpr std::size_t kWidestPairs = 12'000, kMiddlePairs = 12'000, kAllPairs = 1'000'000;
constexpr int kGrid = 4;  // places of the grid on each side of the start, on each axis
constexpr std::size_t kKeptOfGrid = 48, kKeptWidest = 32, kKeptMiddle = 16, kKept = 4, kTriedBySubset = 3;
constexpr double kSameMaximum = 0.5 * kRadPerDeg;  // places nearer than this are one maximum
constexpr double kSmallestStep = 0.008 * kRadPerDeg, kSubsetStep = 0.016 * kRadPerDeg;
constexpr int kHalfSamples = 16;
constexpr int kMostElsewhere = 1;    // of the subsets; the covariance contains how far it is
constexpr double kEdgeShare = 0.99;  // of the search: a result beyond is at its edge
// Least sigma on each axis, in steps of the laser. An edge lies anywhere between two returns, and anywhere in the width
// of a beam, which is about a step: two errors of 1 / sqrt(12) that may be alike all over the image.
constexpr double kLeastSigma = 0.41;

struct ShotPlace {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  double score = -1;
};

/// Improves a place by trying the axes and the diagonals between them. The step is halved when nothing helps.
ShotPlace climb(const ShotScore& score, const PartWeights& weights, const Eigen::Vector3d& from, double step,
                double last, double bound) {
  static const std::array<Eigen::Vector3d, 7> kWays = [] {
    std::array<Eigen::Vector3d, 7> ways;
    for (int i = 0; i < 3; ++i) ways[static_cast<std::size_t>(i)] = Eigen::Vector3d::Unit(i);
    for (int i = 0; i < 4; ++i)
      ways[static_cast<std::size_t>(3 + i)] = Eigen::Vector3d(1, i & 1 ? -1 : 1, i & 2 ? -1 : 1) / std::sqrt(3.0);
    return ways;
  }();
  ShotPlace best{from, score.score(from, weights)};
  const auto try_at = [&](const Eigen::Vector3d& there) {
    const Eigen::Vector3d inside = there.cwiseMax(-bound).cwiseMin(bound);
    const double value = score.score(inside, weights);
    if (!(value > best.score)) return false;
    best = {inside, value};
    return true;
  };
  while (step >= last) {
    const Eigen::Vector3d before = best.turn;
    bool has_helped = false;
    for (const Eigen::Vector3d& way : kWays) {
      // The diagonals are tried only where the axes do not help: they cost more than they bring elsewhere.
      if (has_helped && &way >= &kWays[3]) break;
      has_helped |= try_at(best.turn + step * way) || try_at(best.turn - step * way);
    }
    if (has_helped)
      try_at(best.turn + (best.turn - before));
    else
      step /= 2;
  }
  return best;
}

/// Returns the best places, without those within `apart` of a better one.
std::vector<ShotPlace> best_of(std::vector<ShotPlace> places, double apart, std::size_t most) {
  std::stable_sort(places.begin(), places.end(),
                   [](const ShotPlace& a, const ShotPlace& b) { return a.score > b.score; });
  std::vector<ShotPlace> out;
  for (const ShotPlace& place : places) {
    const bool is_beside = std::any_of(
        out.begin(), out.end(), [&](const ShotPlace& better) { return (better.turn - place.turn).norm() < apart; });
    if (!is_beside) out.push_back(place);
    if (out.size() == most) break;
  }
  return out;
}

/// The scores of a shot at three widths of blur.
class ShotSearch {
 public:
  ShotSearch(const Shot& shot, const LaserPairs& laser, double bound)
      : widest_(shot.image, shot.lens, shot.max_angle, laser.pairs, kWidest, kWidestPairs),
        middle_(shot.image, shot.lens, shot.max_angle, laser.pairs, kMiddle, kMiddlePairs),
        finest_(shot.image, shot.lens, shot.max_angle, laser.pairs, kFinestBlur * laser.step, kAllPairs),
        bound_(bound) {}

  /// Returns the maxima of the whole search, the best first.
  std::vector<ShotPlace> maxima() const {
    const PartWeights all = all_parts();
    std::vector<ShotPlace> places;
    for (int x = -kGrid; x <= kGrid; ++x)
      for (int y = -kGrid; y <= kGrid; ++y)
        for (int z = -kGrid; z <= kGrid; ++z) {
          const Eigen::Vector3d turn = Eigen::Vector3d(x, y, z) * (bound_ / kGrid);
          places.push_back({turn, widest_.score(turn, all)});
        }
    places = best_of(places, 1.3 * bound_ / kGrid, kKeptOfGrid);
    for (ShotPlace& place : places) place = climb(widest_, all, place.turn, kWidest, kWidest / 4, bound_);
    places = best_of(places, kWidest, kKeptWidest);
    for (ShotPlace& place : places) place = climb(middle_, all, place.turn, kMiddle, kMiddle / 4, bound_);
    places = best_of(places, kMiddle, kKeptMiddle);
    for (ShotPlace& place : places) place = climb(finest_, all, place.turn, finest_.blur(), kSmallestStep, bound_);
    return best_of(places, kMiddle, kKept);
  }

  /// Returns the best place for some parts of the scene alone, starting from the maxima of the whole.
  ShotPlace best_for(const PartWeights& weights, const std::vector<ShotPlace>& maxima) const {
    ShotPlace best;
    for (std::size_t i = 0; i < std::min(kTriedBySubset, maxima.size()); ++i) {
      const ShotPlace coarse = climb(middle_, weights, maxima[i].turn, kMiddle / 2, kMiddle / 8, bound_);
      const ShotPlace place = climb(finest_, weights, coarse.turn, finest_.blur(), kSubsetStep, bound_);
      if (place.score > best.score) best = place;
    }
    return best;
  }

  const ShotScore& finest() const { return finest_; }

 private:
  ShotScore widest_, middle_, finest_;
  double bound_;
};

/// Returns the weights of one balanced half sample: of two neighbouring blocks, one is used (McCarthy 1969). The rows
/// of a Hadamard matrix choose, so that each pair of blocks meets each other pair in all combinations equally often.
PartWeights half_sample(unsigned number) {
  PartWeights out{};
  for (unsigned block = 0; block < kPairParts / 2; ++block) {
    const unsigned stratum = block / 2 + 1;
    const bool takes_second = std::popcount(number & stratum) % 2 == 1;
    out[2 * block] = out[2 * block + 1] = (block % 2 == 1) == takes_second ? 1.0F : 0.0F;
  }
  return out;
}

/// Returns the weights without a part of the scene: without a third of the width, or without what is near or far.
std::vector<std::vector<PartWeights>> all_but_parts() {
  std::vector<PartWeights> thirds(3, all_parts()), distances(2, all_parts());
  for (std::size_t part = 0; part < kPairParts; ++part) {
    thirds[part / 2 % kPairColumns * 3 / kPairColumns][part] = 0;
    distances[part % 2][part] = 0;
  }
  return {thirds, distances};
}

Transform<Lens, Scanner> turned(const Transform<Lens, Scanner>& start, const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  if (!(angle > 0)) return start;
  const Eigen::Quaterniond by(Eigen::AngleAxisd(angle, turn / angle));
  return {(by * start.rotation).normalized(), by * start.translation};
}

/// Searches in parts of the scene, and sets the covariance and how many of them end elsewhere.
void set_certainty(const ShotSearch& search, const std::vector<ShotPlace>& maxima, double step, ShotAlignment& out) {
  const Eigen::Vector3d best = maxima[0].turn;
  const auto difference = [&](const PartWeights& weights) -> Eigen::Vector3d {
    const Eigen::Vector3d by = search.best_for(weights, maxima).turn - best;
    ++out.subsets;
    out.elsewhere += by.norm() > kSameMaximum;
    return by;
  };
  std::array<Eigen::Matrix3d, 3> estimates;
  estimates.fill(Eigen::Matrix3d::Zero());
  for (unsigned i = 0; i < kHalfSamples; ++i) {
    const Eigen::Vector3d by = difference(half_sample(i));
    estimates[0] += by * by.transpose() / kHalfSamples;
  }
  const auto parts = all_but_parts();
  for (std::size_t kind = 0; kind < parts.size(); ++kind)
    for (const PartWeights& weights : parts[kind]) {
      const Eigen::Vector3d by = difference(weights);
      const auto count = static_cast<double>(parts[kind].size());
      estimates[1 + kind] += by * by.transpose() * ((count - 1) / count);
    }
  out.covariance = *std::max_element(estimates.begin(), estimates.end(),
                                     [](const auto& one, const auto& other) { return one.trace() < other.trace(); });
  out.covariance.diagonal().array() += std::pow(kLeastSigma * step, 2);
}

/// Sets the reasons for which the rotation does not count as determined.
void set_doubts(const ShotPlace& best, const ShotAlignmentConfig& config, ShotAlignment& out) {
  if (out.outlines < kFewestShotOutlines)
    out.doubts.push_back(
        fmt::format("the laser shows {} outlines in the image, and {} are needed", out.outlines, kFewestShotOutlines));
  const Eigen::Vector3d deg = best.turn * kDegPerRad;
  if (best.turn.cwiseAbs().maxCoeff() > kEdgeShare * config.search_deg * kRadPerDeg)
    out.doubts.push_back(fmt::format("the best rotation is at the edge of the search ({:.2f}, {:.2f}, {:.2f} deg)",
                                     deg.x(), deg.y(), deg.z()));
  if (out.elsewhere > kMostElsewhere)
    out.doubts.push_back(
        fmt::format("{} of {} parts of the scene alone give another rotation, more than {:.1f} deg away", out.elsewhere,
                    out.subsets, kSameMaximum * kDegPerRad));
  if (!(out.sigma() <= config.most_sigma_deg * kRadPerDeg))
    out.doubts.push_back(fmt::format("the rotation has a standard deviation of {:.2f} deg, and {:.2f} deg are allowed",
                                     out.sigma() * kDegPerRad, config.most_sigma_deg));
}

}  // namespace

std::string ShotAlignmentConfig::validate() const {
  if (!(search_deg > 0 && search_deg <= 15))
    return fmt::format("search_deg is {}; allowed: above 0, to 15 deg", search_deg);
  if (!(most_sigma_deg > 0 && most_sigma_deg <= 5))
    return fmt::format("most_sigma_deg is {}; allowed: above 0, to 5 deg", most_sigma_deg);
  return {};
}

double ShotAlignment::sigma() const { return std::sqrt(covariance.trace()); }

Result<ShotAlignment> align_shot(const Shot& shot, const Transform<Lens, Scanner>& start,
                                 const ShotAlignmentConfig& config) {
  if (const std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (shot.image.width < 32 || shot.image.height < 32)
    return Error{ErrorCode::Invalid,
                 fmt::format("the image has {} x {} pixels; 32 are needed", shot.image.width, shot.image.height)};
  if (shot.lens.width != static_cast<std::uint32_t>(shot.image.width) ||
      shot.lens.height != static_cast<std::uint32_t>(shot.image.height))
    return Error{ErrorCode::Invalid, fmt::format("the image has {} x {} pixels, and the lens {} x {}", shot.image.width,
                                                 shot.image.height, shot.lens.width, shot.lens.height)};
  if (shot.intensity.size() != shot.p_scanner.size())
    return Error{ErrorCode::Invalid,
                 fmt::format("{} returns have {} intensities", shot.p_scanner.size(), shot.intensity.size())};
  const LaserPairs laser = laser_pairs(shot.p_scanner, shot.intensity, start, shot.lens, shot.max_angle);
  if (laser.pairs.size() < kFewestPairs)
    return Error{
        ErrorCode::Unavailable,
        fmt::format("the image shows {} pairs of neighbouring returns, and {} are needed: is the start that of "
                    "this lens, and the cloud of the same moment?",
                    laser.pairs.size(), kFewestPairs)};
  const ShotSearch search(shot, laser, config.search_deg * kRadPerDeg);
  const std::vector<ShotPlace> maxima = search.maxima();
  ShotAlignment out;
  out.T_lens_scanner = turned(start, maxima[0].turn);
  out.score = maxima[0].score;
  out.score_start = search.finest().score(Eigen::Vector3d::Zero(), all_parts());
  if (maxima.size() > 1) out.score_elsewhere = maxima[1].score;
  out.pairs = search.finest().pairs_in_image(maxima[0].turn);
  out.outlines = static_cast<std::size_t>(std::count_if(
      laser.pairs.begin(), laser.pairs.end(), [](const auto& pair) { return pair.kind >= PairKind::OutlineBeside; }));
  set_certainty(search, maxima, laser.step, out);
  set_doubts(maxima[0], config, out);
  return out;
}

}  // namespace hueline::calibration
