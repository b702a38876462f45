#include "calibration/mount/alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/mount/alignment_score.hpp"
#include "calibration/mount/head_adjustment.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr std::size_t kFewestOutlines = 200;
constexpr float kFinestBlur_px = 1.0F, kWideBlur_px = 2.5F;
constexpr std::size_t kShotsWhenWide = 48;
constexpr std::size_t kWidestSamples = 5'000, kWideSamples = 15'000, kFineSamples = 1'000'000;
constexpr double kFinestStep = 0.004 * kRadPerDeg;
constexpr double kFinestTime_s = 2e-4;
constexpr std::size_t kMostGroups = 4;  // most groups that are searched independently

/// One candidate of the search.
struct Place {
  HeadCorrection at = HeadCorrection::Zero();
  double score = -1e300;
};

/// Step widths and limits of a climb: rotations in rad, time in s.
struct Steps {
  double turn, time, last_turn, last_time, bound_turn, bound_time;
};

/// Improves a candidate by pattern search (Hooke and Jeeves 1961). It tries each axis up and down, then repeats the
/// step that helped, and halves the steps when nothing helps.
Place climb(const AlignmentScore& score, const HeadCorrection& from, Steps steps) {
  Place best{from, score.score(from)};
  const auto try_at = [&](HeadCorrection there) {
    for (int i = 0; i < 3; ++i) there[i] = std::clamp(there[i], -steps.bound_turn, steps.bound_turn);
    there[3] = std::clamp(there[3], -steps.bound_time, steps.bound_time);
    const double value = score.score(there);
    if (!(value > best.score)) return false;
    best = {there, value};
    return true;
  };
  const int axes = steps.bound_time > 0 ? 4 : 3;
  while (steps.turn >= steps.last_turn || (steps.bound_time > 0 && steps.time >= steps.last_time)) {
    const HeadCorrection before = best.at;
    bool helped = false;
    for (int axis = 0; axis < axes; ++axis) {
      const double by = axis < 3 ? steps.turn : steps.time;
      for (const double way : {by, -by}) {
        HeadCorrection there = best.at;
        there[axis] += way;
        if (!try_at(there)) continue;
        helped = true;
        break;
      }
    }
    if (helped) {
      try_at(best.at + (best.at - before));
    } else {
      steps.turn /= 2;
      steps.time /= 2;
    }
  }
  return best;
}

/// Returns the best places of a grid over the whole search, without places next to a better one.
std::vector<Place> scan(const AlignmentScore& score, double bound) {
  constexpr int kHalf = 3;
  constexpr std::size_t kKept = 8;
  std::vector<Place> all, out;
  for (int x = -kHalf; x <= kHalf; ++x)
    for (int y = -kHalf; y <= kHalf; ++y)
      for (int z = -kHalf; z <= kHalf; ++z) {
        const HeadCorrection there(bound * x / kHalf, bound * y / kHalf, bound * z / kHalf, 0);
        all.push_back({there, score.score(there)});
      }
  std::stable_sort(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.score > b.score; });
  for (const Place& place : all) {
    const bool is_beside = std::any_of(out.begin(), out.end(), [&](const Place& better) {
      return (better.at - place.at).cwiseAbs().maxCoeff() < 1.5 * bound / kHalf;
    });
    if (!is_beside) out.push_back(place);
    if (out.size() == kKept) break;
  }
  return out;
}

/// Returns the rotation from one attitude to another, about the axes of the rotated frame.
Eigen::Vector3d turn_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  Eigen::Quaterniond by = from.conjugate() * to;
  if (by.w() < 0) by.coeffs() *= -1;
  const Eigen::AngleAxisd turn(by);
  return turn.angle() * turn.axis();
}

/// Returns the widths of blur, from as wide as the search to the finest, px.
std::vector<float> blurs(double focal_px, double search_deg) {
  std::vector<float> out;
  for (auto blur = static_cast<float>(focal_px * search_deg * kRadPerDeg / 4); blur > kFinestBlur_px; blur /= 2)
    out.push_back(blur);
  out.push_back(kFinestBlur_px);
  return out;
}

struct Found {
  HeadCorrection correction = HeadCorrection::Zero();
  double score_start = 0, score = 0;
  std::size_t outlines = 0, samples = 0;
};

Found search(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
             const std::vector<std::size_t>& which, const Transform<Body, CameraHead>& start,
             const AlignmentConfig& config, const HeadCorrection* from) {
  Found out;
  const double focal = lenses[shots[which[0]].lens].values.focal_px.mean();
  const double bound = config.search_deg * kRadPerDeg;
  auto widths = blurs(focal, config.search_deg);
  // A search in a part of the shots starts from the result of all shots and needs only the finest steps.
  if (from)
    widths.erase(widths.begin(),
                 widths.end() - std::min<std::ptrdiff_t>(2, static_cast<std::ptrdiff_t>(widths.size())));
  std::vector<Place> places{{from ? *from : HeadCorrection::Zero(), 0}};
  for (std::size_t level = 0; level < widths.size(); ++level) {
    const bool is_last = level + 1 == widths.size(), is_fine = is_last && !config.use_relation;
    const std::size_t most_samples = is_fine ? kFineSamples : is_last || level > 0 ? kWideSamples : kWidestSamples;
    // Wide blurs need few pictures, so that only every n-th shot is used.
    std::vector<std::size_t> some;
    std::size_t apart = widths[level] > kWideBlur_px || config.use_relation
                            ? std::max<std::size_t>(1, which.size() / kShotsWhenWide)
                            : 1;
    while (apart > 1 && (apart % 2 == 0 || apart % 3 == 0 || apart % 5 == 0))
      ++apart;  // so that no lens of a head of five, six or eight is always skipped
    for (std::size_t i = 0; i < which.size(); i += apart) some.push_back(which[i]);
    const AlignmentScore score(lenses, shots, some, start, config, widths[level], most_samples);
    out.outlines = score.outlines();
    out.samples = score.samples();
    if (!from && level == 0) places = scan(score, bound);
    const double step = widths[level] / focal;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (config.progress)
        config.progress(fmt::format("searching, blur {:.1f} px", widths[level]),
                        static_cast<double>(i) / static_cast<double>(places.size()));
      places[i] = climb(score, places[i].at,
                        {step, config.search_time_s / 4, is_fine ? kFinestStep : step / 4,
                         is_fine ? kFinestTime_s : config.search_time_s / 16, bound, config.search_time_s});
    }
    // Several maxima at a wide blur merge at a narrow one. The weaker places and those that have met are removed.
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.score > b.score; });
    std::vector<Place> kept;
    for (const Place& place : places) {
      const bool has_met = std::any_of(
          kept.begin(), kept.end(), [&](const Place& other) { return (other.at - place.at).head<3>().norm() < step; });
      if (!has_met && kept.size() < std::max<std::size_t>(2, places.size() * 2 / 3)) kept.push_back(place);
    }
    places = std::move(kept);
    if (is_last) {
      out.score_start = score.score(HeadCorrection::Zero());
      out.score = places[0].score;
    }
  }
  out.correction = places[0].at;
  return out;
}

/// Returns an error if the result cannot be right: too few outlines, or a place at the edge of the search.
Status check(const Found& found, const AlignmentConfig& config) {
  if (config.use_outlines && found.outlines < kFewestOutlines)
    return Error{
        ErrorCode::Unavailable,
        fmt::format(
            "the images show {} outlines of near objects, and {} are needed: drive past posts, trees and corners",
            found.outlines, kFewestOutlines)};
  const double bound = config.search_deg * kRadPerDeg * 0.999;
  if (found.correction.head<3>().cwiseAbs().maxCoeff() >= bound ||
      (config.search_time_s > 0 && std::abs(found.correction[3]) >= 0.999 * config.search_time_s))
    return Error{ErrorCode::Unavailable,
                 fmt::format("the best result is at the edge of the search ({:.2f}, {:.2f}, {:.2f} deg): the error of "
                             "the start is larger than the search, or image and laser do not fit together",
                             found.correction[0] / kRadPerDeg, found.correction[1] / kRadPerDeg,
                             found.correction[2] / kRadPerDeg)};
  return {};
}

/// Sets what the search has found.
void set_found(const Found& found, const Transform<Body, CameraHead>& start, Alignment& out) {
  out.T_body_head = corrected(start, found.correction);
  out.time_offset_s = found.correction[3];
  out.score_start = found.score_start;
  out.score = found.score;
  out.samples = found.outlines + found.samples;
}

}  // namespace

std::string AlignmentConfig::validate() const {
  if (!(search_deg > 0 && search_deg <= 15))
    return fmt::format("search_deg is {}; allowed: above 0, to 15 deg", search_deg);
  if (!(search_time_s >= 0 && search_time_s <= 1))
    return fmt::format("search_time_s is {}; allowed: 0 to 1 s", search_time_s);
  if (!use_outlines && !use_intensity) return "outlines and intensity are both switched off";
  if (groups > 64) return fmt::format("groups is {}; allowed: to 64", groups);
  return {};
}

Result<Alignment> align_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                             const Transform<Body, CameraHead>& start, const AlignmentConfig& config) {
  if (const std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (shots.empty()) return Error{ErrorCode::Unavailable, "no image with laser points around its moment"};
  for (const AlignmentShot& shot : shots)
    if (shot.lens >= lenses.size() || shot.image.width < 32 || shot.image.height < 32 || !shot.samples)
      return Error{ErrorCode::Invalid, "a shot has an unknown lens, too small an image or no samples"};
  std::vector<std::size_t> all(shots.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  Found found = search(lenses, shots, all, start, config, nullptr);
  if (const Status good = check(found, config); !good.ok()) return good.error();
  Alignment out;
  set_found(found, start, out);
  out.shots = shots.size();
  AlignmentConfig fine = config;
  if (config.use_relation) {
    const auto adjusted =
        adjust_head(lenses, shots, out.T_body_head, out.time_offset_s, config.search_time_s > 0, config);
    if (adjusted.ok()) {
      out.moved << turn_between(out.T_body_head.rotation, adjusted->T_body_head.rotation),
          adjusted->time_offset_s - out.time_offset_s;
      out.T_body_head = adjusted->T_body_head;
      out.time_offset_s = adjusted->time_offset_s;
      out.covariance = adjusted->covariance;
      out.patches = adjusted->patches;
      return out;
    }
    out.not_adjusted = adjusted.error().message;
    // The search had left out its last steps, because the adjustment was to follow.
    fine.use_relation = false;
    found = search(lenses, shots, all, start, fine, &found.correction);
    set_found(found, start, out);
  }
  const std::size_t groups =
      std::min({static_cast<std::size_t>(std::max(0, config.groups)), kMostGroups, shots.size()});
  if (groups >= 2) {
    std::vector<HeadCorrection> parts;
    for (std::size_t g = 0; g < groups; ++g) {
      // Neighbouring shots see the same objects, so that each group is a continuous stretch.
      const std::vector<std::size_t> part(all.begin() + static_cast<std::ptrdiff_t>(g * all.size() / groups),
                                          all.begin() + static_cast<std::ptrdiff_t>((g + 1) * all.size() / groups));
      parts.push_back(search(lenses, shots, part, start, fine, &found.correction).correction);
    }
    HeadCorrection mean = HeadCorrection::Zero();
    for (const auto& p : parts) mean += p / static_cast<double>(groups);
    for (const auto& p : parts)
      out.covariance += (p - mean) * (p - mean).transpose() / static_cast<double>(groups * (groups - 1));
  }
  return out;
}

}  // namespace hueline::calibration
