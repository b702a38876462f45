#include "fusion/object_measurement.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

namespace hueline::fusion {
namespace {

constexpr std::size_t kMostNear = 1000;  // points looked at; denser scanners give nearer ones
constexpr std::size_t kAround = 24;     // nearest points of a thing that have to stand around the ray: of so many in the open, all on one side is 3e-6
constexpr std::size_t kFewest = 6;      // points that make a thing
constexpr double kMostThrough_m = 0.2;  // a beam went through a thing if its points stand around it within this ...
constexpr double kThroughMargin_m = 0.04;  // ... and at least so far: noise puts points beside a post
constexpr double kThroughShare = 0.25;  // so many beams through a thing, for each of its own points, and it was not there when they passed
constexpr double kMostAround_m = 0.25;  // across the ray: what stands around it must be no farther

/// A point beside the ray: right and up across it, ahead along it, m.
struct Near {
  Eigen::Vector2d across;
  double ahead;
  std::size_t index;
  int thing = -1;
};

/// Two directions across the ray.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across_of(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d right = direction.unitOrthogonal();
  return {right, direction.cross(right)};
}

/// Points within reach, nearest to the ray first.
std::vector<Near> near_points(const PickedRay& ray, std::span<const SurfacePoint> points, const ObjectMeasurementConfig& config) {
  const auto [right, up] = across_of(ray.direction_enu);
  std::vector<Near> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d to = points[i].p_enu - ray.from_enu;
    const double ahead = to.dot(ray.direction_enu);
    const Eigen::Vector2d across(to.dot(right), to.dot(up));
    if (ahead > 0 && across.norm() <= std::min(config.reach_m, config.reach * ahead)) out.push_back({across, ahead, i});
  }
  std::sort(out.begin(), out.end(), [](const Near& a, const Near& b) { return std::pair(a.across.norm(), a.index) < std::pair(b.across.norm(), b.index); });
  if (out.size() > kMostNear) out.resize(kMostNear);
  return out;
}

/// Numbers the things: points linked by steps of at most `link_m`. Returns how many there are.
int link(std::vector<Near>& near, double link_m) {
  int things = 0;
  std::vector<std::size_t> open;
  for (std::size_t first = 0; first < near.size(); ++first) {
    if (near[first].thing >= 0) continue;
    near[first].thing = things;
    open.assign(1, first);
    while (!open.empty()) {
      const Near here = near[open.back()];
      open.pop_back();
      for (std::size_t i = 0; i < near.size(); ++i) {
        if (near[i].thing >= 0) continue;
        const double ahead = near[i].ahead - here.ahead;
        if ((near[i].across - here.across).squaredNorm() + ahead * ahead > link_m * link_m) continue;
        near[i].thing = things;
        open.push_back(i);
      }
    }
    ++things;
  }
  return things;
}

/// True if a circle of that radius around the origin lies within the points' hull: with 0, if they leave no half of the plane free.
bool stand_around(const std::vector<Eigen::Vector2d>& points, double radius_m) {
  constexpr int kDirections = 16;
  for (int k = 0; k < kDirections; ++k) {
    const double turn = 2 * std::numbers::pi * k / kDirections;
    const Eigen::Vector2d direction(std::cos(turn), std::sin(turn));
    if (std::none_of(points.begin(), points.end(), [&](const Eigen::Vector2d& p) { return p.dot(direction) > radius_m; })) return false;
  }
  return true;
}

/// Beams that went through each thing on their way to something at least `behind_m` farther: it was not there then, or has gaps.
std::vector<int> beams_through(const std::vector<Near>& near, std::span<const SurfacePoint> points, int things, double behind_m) {
  std::vector<int> through(static_cast<std::size_t>(things), 0);
  std::vector<std::vector<Eigen::Vector2d>> around(static_cast<std::size_t>(things));
  for (const Near& target : near) {
    const SurfacePoint& hit = points[target.index];
    const double range = (hit.p_enu - hit.from_enu).norm();
    if (!(range > 0)) continue;
    const Eigen::Vector3d beam = (hit.p_enu - hit.from_enu) / range;
    const auto [right, up] = across_of(beam);
    for (auto& some : around) some.clear();
    for (const Near& other : near) {
      if (other.thing == target.thing) continue;
      const Eigen::Vector3d to = points[other.index].p_enu - hit.from_enu;
      const double ahead = to.dot(beam);
      if (ahead <= 0 || ahead > range - behind_m) continue;
      const Eigen::Vector2d across(to.dot(right), to.dot(up));
      if (across.squaredNorm() < kMostThrough_m * kMostThrough_m) around[static_cast<std::size_t>(other.thing)].push_back(across);
    }
    for (std::size_t thing = 0; thing < around.size(); ++thing)
      if (around[thing].size() >= kFewest && stand_around(around[thing], kThroughMargin_m)) ++through[thing];
  }
  return through;
}

/// Where a thing's surface is cut by a line beside the ray.
struct Cut {
  int thing = -1;
  double ahead = 0;                  ///< m along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< right, up, ahead; towards the lens
  double scatter_m = 0, sigma_m = 0; ///< of the points about the surface, along its normal; of `ahead`
  double gap_m = 0;                  ///< from the ray to the nearest point of the thing
  double roughness_m = 0;            ///< the same of all of its points around the ray
  double width_m = 0;                ///< rms of the points across the ray, where they are narrower
  double off_m = 0;                  ///< from where it is cut to the nearest of its points
  std::vector<std::size_t> points;   ///< of the surface
};

/// The nearest `count` of a thing's points, then twice as many, and so on while they lie within kMostAround: a scanner's points stand in lines,
/// and the nearest ones may all be of one line. `use` says true when there are enough.
template <class Use>
bool growing(const std::vector<Near>& near, std::span<const std::size_t> points, const Eigen::Vector2d& at, std::size_t count, const Use& use) {
  for (std::size_t n = std::min(count, points.size());; n = std::min(2 * n, points.size())) {
    if (use(points.first(n))) return true;
    if (n == points.size() || (near[points[n]].across - at).norm() > kMostAround_m) return false;
  }
}

/// A surface through the points: their distance along the ray as a plane over where they stand across it, for the noise of ranges is along the
/// ray. Points that stand in a line (a thin post, a single line of the scanner) say nothing of the surface's slope across the line: none.
Cut cut_surface(const std::vector<Near>& near, std::span<const std::size_t> points, const Eigen::Vector2d& at, double narrow_m) {
  const double count = static_cast<double>(points.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double mean_ahead = 0;
  for (const std::size_t i : points) mean += near[i].across / count, mean_ahead += near[i].ahead / count;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d mixed = Eigen::Vector2d::Zero();
  for (const std::size_t i : points) {
    const Eigen::Vector2d off = near[i].across - mean;
    spread += off * off.transpose();
    mixed += off * (near[i].ahead - mean_ahead);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread);
  Cut cut;
  cut.width_m = std::sqrt(std::max(0.0, solver.eigenvalues()[0]) / count);
  const Eigen::Vector2d off = at - mean;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double leverage = 1 / count, unknown = 0;
  int unknowns = 1;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d axis = solver.eigenvectors().col(k);
    const double sum = solver.eigenvalues()[k];
    if (std::sqrt(std::max(0.0, sum) / count) < narrow_m) {
      unknown += std::pow(off.dot(axis), 2);
      continue;
    }
    slope += axis * (mixed.dot(axis) / sum);
    leverage += std::pow(off.dot(axis), 2) / sum;
    ++unknowns;
  }
  double square = 0;
  for (const std::size_t i : points) square += std::pow(near[i].ahead - mean_ahead - slope.dot(near[i].across - mean), 2);
  const double noise = std::sqrt(square / std::max(1.0, count - unknowns));
  cut.ahead = mean_ahead + slope.dot(off);
  cut.normal = Eigen::Vector3d(slope.x(), slope.y(), -1).normalized();
  cut.scatter_m = noise * std::abs(cut.normal.z());
  cut.sigma_m = std::sqrt(noise * noise * leverage + unknown);  // a slope that nobody knows: 45 degrees
  cut.off_m = 1e9;
  for (const std::size_t i : points) cut.off_m = std::min(cut.off_m, std::hypot((near[i].across - at).norm(), near[i].ahead - cut.ahead));
  cut.points.assign(points.begin(), points.end());
  return cut;
}

/// The nearest thing that covers the line at `at`.
std::optional<Cut> first_cut(const std::vector<Near>& near, const std::vector<std::uint8_t>& is_through, const Eigen::Vector2d& at, const ObjectMeasurementConfig& config) {
  std::vector<std::size_t> order(near.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return (near[a].across - at).squaredNorm() < (near[b].across - at).squaredNorm(); });
  std::vector<std::vector<std::size_t>> nearest(is_through.size());
  for (const std::size_t i : order) nearest[static_cast<std::size_t>(near[i].thing)].push_back(i);
  const int things = static_cast<int>(is_through.size());
  const auto fewest = static_cast<std::size_t>(config.surface_points);
  int best = -1;
  double best_ahead = 0;
  for (int thing = 0; thing < things; ++thing) {
    const auto& points = nearest[static_cast<std::size_t>(thing)];
    if (points.size() < kFewest) continue;
    if (is_through[static_cast<std::size_t>(thing)]) continue;
    if (!growing(near, points, at, kAround, [&](std::span<const std::size_t> some) {
          std::vector<Eigen::Vector2d> around;
          for (const std::size_t i : some) around.push_back(near[i].across - at);
          return stand_around(around, 0);
        }))
      continue;
    const std::size_t first = std::min(fewest, points.size());
    double ahead = 0;
    for (std::size_t i = 0; i < first; ++i) ahead += near[points[i]].ahead / static_cast<double>(first);
    if (best >= 0 && best_ahead <= ahead) continue;
    best = thing;
    best_ahead = ahead;
  }
  if (best < 0) return std::nullopt;
  const auto& points = nearest[static_cast<std::size_t>(best)];
  Cut cut;
  growing(near, points, at, fewest, [&](std::span<const std::size_t> some) {
    cut = cut_surface(near, some, at, config.narrow_m);
    return cut.width_m >= config.narrow_m;
  });
  // More points of a post only make it longer: the nearest tell its place best.
  if (cut.width_m < config.narrow_m) cut = cut_surface(near, std::span(points).first(std::min(fewest, points.size())), at, config.narrow_m);
  cut.thing = best;
  cut.gap_m = (near[points[0]].across - at).norm();
  double square = 0, count = 0;
  for (const std::size_t i : points) {
    const Eigen::Vector2d off = near[i].across - at;
    if (off.norm() > kMostAround_m) break;
    const double beyond = (near[i].ahead - cut.ahead) * cut.normal.z() + off.dot(cut.normal.head<2>());
    square += beyond * beyond;
    ++count;
  }
  cut.roughness_m = std::sqrt(square / std::max(1.0, count));
  return cut;
}

Error cannot(const std::string& why) { return {ErrorCode::Unavailable, why}; }

}  // namespace

std::string ObjectMeasurementConfig::validate() const {
  if (!(reach_m >= 0.05 && reach_m <= 10)) return fmt::format("reach_m is {}; allowed: 0.05 to 10 m", reach_m);
  if (!(reach >= 0.001 && reach <= 0.5)) return fmt::format("reach is {}; allowed: 0.001 to 0.5 rad", reach);
  if (!(link_m >= 0.01 && link_m <= 10)) return fmt::format("link_m is {}; allowed: 0.01 to 10 m", link_m);
  if (surface_points < 6 || surface_points > 200) return fmt::format("surface_points is {}; allowed: 6 to 200", surface_points);
  if (!(narrow_m >= 0 && narrow_m <= 1)) return fmt::format("narrow_m is {}; allowed: 0 to 1 m", narrow_m);
  if (!(most_scatter_m > 0 && most_scatter_m <= 10)) return fmt::format("most_scatter_m is {}; allowed: above 0 to 10 m", most_scatter_m);
  if (!(most_roughness_m > 0 && most_roughness_m <= 10)) return fmt::format("most_roughness_m is {}; allowed: above 0 to 10 m", most_roughness_m);
  if (!(most_gap_m > 0 && most_gap_m <= 10)) return fmt::format("most_gap_m is {}; allowed: above 0 to 10 m", most_gap_m);
  if (!(most_gap >= 0 && most_gap <= 1)) return fmt::format("most_gap is {}; allowed: 0 to 1 rad", most_gap);
  if (!(most_oblique_deg > 0 && most_oblique_deg < 90)) return fmt::format("most_oblique_deg is {}; allowed: above 0, below 90", most_oblique_deg);
  if (seen_through < 1 || seen_through > 1000) return fmt::format("seen_through is {}; allowed: 1 to 1000", seen_through);
  if (!(edge_sigma >= 0 && edge_sigma <= 10)) return fmt::format("edge_sigma is {}; allowed: 0 to 10", edge_sigma);
  return {};
}

Result<MeasuredObject> measure_object(const PickedRay& ray, std::span<const SurfacePoint> points, const ObjectMeasurementConfig& config) {
  std::vector<Near> near = near_points(ray, points, config);
  if (near.empty()) return cannot("the laser saw nothing there");
  const auto through = beams_through(near, points, link(near, config.link_m), config.link_m);
  // What most beams went through hides nothing; what a few went through may.
  std::vector<double> own(through.size(), 0);
  for (const Near& one : near) ++own[static_cast<std::size_t>(one.thing)];
  std::vector<std::uint8_t> is_through;
  for (std::size_t thing = 0; thing < through.size(); ++thing) is_through.push_back(through[thing] >= std::max<double>(config.seen_through, kThroughShare * own[thing]));
  const auto cut = first_cut(near, is_through, Eigen::Vector2d::Zero(), config);
  if (!cut) return cannot(fmt::format("{} laser points near the pixel, but none of what they are on stands all around it", near.size()));
  if (through[static_cast<std::size_t>(cut->thing)] >= config.seen_through)
    return cannot(fmt::format("not solid: the laser saw past or through what stands at {:.1f} m to something behind it (leaves, or what stood there at another time)", cut->ahead));
  if (cut->gap_m > config.most_gap_m + config.most_gap * cut->ahead)
    return cannot(fmt::format("no laser point nearer to the pixel than {:.2f} m, on what is {:.1f} m away", cut->gap_m, near[cut->points[0]].ahead));
  if (cut->roughness_m > config.most_roughness_m)
    return cannot(fmt::format("no surface: around the pixel the laser's points at {:.1f} m are {:.2f} m deep (leaves, wires)", near[cut->points[0]].ahead, cut->roughness_m));
  if (cut->scatter_m > config.most_scatter_m)
    return cannot(fmt::format("no surface: the laser's points at {:.1f} m scatter by {:.2f} m", near[cut->points[0]].ahead, cut->scatter_m));
  const double cosine = std::abs(cut->normal.z()), oblique = std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
  if (oblique > config.most_oblique_deg || cut->ahead <= 0 || cut->off_m > config.link_m) return cannot(fmt::format("the surface at {:.1f} m is seen too flat ({:.0f} deg)", near[cut->points[0]].ahead, oblique));
  // What may be meant within the pixel's uncertainty: elsewhere there must be nothing else before or behind it.
  for (int k = 0; k < 8; ++k) {
    const double turn = k * std::numbers::pi / 4, aside = config.edge_sigma * ray.sigma * cut->ahead;
    const auto beside = first_cut(near, is_through, aside * Eigen::Vector2d(std::cos(turn), std::sin(turn)), config);
    if (!beside) return cannot(fmt::format("an edge: the surface at {:.1f} m ends within {:.2f} m of where the pixel looks", cut->ahead, aside));
    if (beside->thing != cut->thing) return cannot(fmt::format("an edge: something at {:.1f} m and something at {:.1f} m", std::min(cut->ahead, beside->ahead), std::max(cut->ahead, beside->ahead)));
  }

  MeasuredObject out;
  out.p_enu = ray.from_enu + cut->ahead * ray.direction_enu;
  out.distance_m = cut->ahead;
  out.oblique_deg = oblique;
  out.scatter_m = cut->scatter_m;
  out.points = static_cast<int>(cut->points.size());
  std::vector<float> seconds;
  double common = 0;
  for (const std::size_t i : cut->points) {
    seconds.push_back(points[near[i].index].seconds);
    common += std::pow(points[near[i].index].sigma_m, 2) / (3.0 * static_cast<double>(cut->points.size()));
  }
  std::nth_element(seconds.begin(), seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2), seconds.end());
  out.seconds = seconds[seconds.size() / 2];
  // p = from + d n(mean - from) / n d: across the ray the direction's error, along it that error through the surface's slope, and the surface's own.
  const auto [right, up] = across_of(ray.direction_enu);
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  const Eigen::Vector3d axes[2] = {right, up};
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d moved = cut->ahead * (axes[k] - ray.direction_enu * (cut->normal[k] / cut->normal.z()));
    across += ray.sigma * ray.sigma * moved * moved.transpose();
  }
  out.covariance = across + cut->sigma_m * cut->sigma_m * ray.direction_enu * ray.direction_enu.transpose() + common * Eigen::Matrix3d::Identity();
  return out;
}

}  // namespace hueline::fusion
