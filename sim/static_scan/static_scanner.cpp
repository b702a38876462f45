#include "sim/static_scan/static_scanner.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "sim/byte_file.hpp"
#include "sim/noise.hpp"

namespace hueline::sim {
namespace {

/// Returns 65536 quantiles of the normal distribution, with which 16 random bits give one normal number.
const std::vector<float>& normal_table() {
  static const std::vector<float> table = [] {
    std::vector<float> out(65536);
    // The table is computed once, by bisection of the distribution function.
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double wanted = (static_cast<double>(i) + 0.5) / 65536;
      double low = -8, high = 8;
      for (int k = 0; k < 50; ++k) {
        const double middle = (low + high) / 2;
        (0.5 * std::erfc(-middle / std::sqrt(2.0)) < wanted ? low : high) = middle;
      }
      out[i] = static_cast<float>(low);
    }
    return out;
  }();
  return table;
}

constexpr double kGroundStep = 0.5;

}  // namespace

/// Everything that one upright plane of beams can meet.
struct StaticScan::Column {
  double cos_azimuth = 1, sin_azimuth = 0;
  std::vector<double> ground;  // height of the ground every kGroundStep
  struct Upright {
    double distance, bottom, top;  // a wall or a pole
  };
  std::vector<Upright> uprights;
  struct Ball {
    Vec3 centre;
    double along, off_squared, radius, lowest_tan, highest_tan;
    int sphere;      // number of the sphere; -1: a crown
    double density;  // density of a crown
  };
  std::vector<Ball> balls;
};

StaticScan::StaticScan(const StaticSite& site, const StaticScannerConfig& config) : site_(site), config_(config) {
  const auto add = [&](double azimuth, double elevation, double width, double height, double step) {
    const auto columns = static_cast<std::uint32_t>(width / step), rows = static_cast<std::uint32_t>(height / step) + 1;
    patches_.push_back({azimuth, elevation, step, columns, rows, column_count_});
    column_count_ += columns;
  };
  add(-kPi, radians(config.lowest_deg), 2 * kPi, radians(config.highest_deg - config.lowest_deg),
      radians(config.step_deg));
  if (config.window_step_deg <= 0) return;
  const double half = radians(config.window_half_deg), step = radians(config.window_step_deg);
  for (std::size_t i = 0; i < site.spheres.size(); ++i) {
    const Vec3& c = site.spheres[i].centre;
    add(std::atan2(c.y, c.x) - half, std::atan2(c.z, std::hypot(c.x, c.y)) - half, 2 * half, 2 * half, step);
    // Windows around crowns, where there is only clutter: nothing in them may be taken for a target.
    if (site.crowns.empty()) continue;
    const Vec3& other = site.crowns[(7 * i) % site.crowns.size()].centre;
    add(std::atan2(other.y, other.x) - half, std::atan2(other.z, std::hypot(other.x, other.y)) - half, 2 * half,
        2 * half, step);
  }
}

void StaticScan::prepare(double azimuth, Column& column) const {
  const double ca = std::cos(azimuth), sa = std::sin(azimuth);
  column.cos_azimuth = ca;
  column.sin_azimuth = sa;
  const auto samples = static_cast<std::size_t>(config_.reach_m / kGroundStep);
  column.ground.resize(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double s = kGroundStep * static_cast<double>(i + 1);
    column.ground[i] = site_.ground(s * ca, s * sa);
  }
  column.uprights.clear();
  column.balls.clear();
  for (const StaticWall& wall : site_.walls) {
    const double dx = wall.x1 - wall.x0, dy = wall.y1 - wall.y0, across = ca * dy - sa * dx;
    if (std::abs(across) < 1e-9) continue;
    const double share = (sa * wall.x0 - ca * wall.y0) / across, distance = (wall.x0 * dy - wall.y0 * dx) / across;
    if (share >= 0 && share <= 1 && distance > 0.5) column.uprights.push_back({distance, wall.bottom, wall.top});
  }
  const auto pole = [&](double x, double y, double radius, double bottom, double top) {
    const double along = ca * x + sa * y, off = ca * y - sa * x;
    if (along > 0.5 && std::abs(off) < radius)
      column.uprights.push_back({along - std::sqrt(radius * radius - off * off), bottom, top});
  };
  for (const StaticPole& p : site_.poles) pole(p.x, p.y, p.radius, p.bottom, p.top);
  const auto ball = [&](const Vec3& c, double radius, int sphere, double density) {
    const double along = ca * c.x + sa * c.y, off = ca * c.y - sa * c.x;
    if (along <= radius || std::abs(off) >= radius) return;
    const double near = along - radius, far = along + radius, low = c.z - radius, high = c.z + radius;
    column.balls.push_back({c, along, off * off, radius, std::min(low / near, low / far),
                            std::max(high / near, high / far), sphere, density});
  };
  for (std::size_t i = 0; i < site_.spheres.size(); ++i) {
    const StaticSphere& sphere = site_.spheres[i];
    ball(sphere.centre, sphere.radius, static_cast<int>(i), 0);
    pole(sphere.centre.x, sphere.centre.y, 0.018, sphere.centre.z - sphere.radius - sphere.stand_height,
         sphere.centre.z - 0.98 * sphere.radius);
  }
  for (const StaticCrown& crown : site_.crowns) ball(crown.centre, crown.radius, -1, crown.density);
}

/// Returns what a beam hits first. `ground_at` only grows from row to row, because a higher beam meets the ground
/// farther away.
StaticScan::Hit StaticScan::nearest(const Column& column, double ce, double se, std::size_t& ground_at,
                                    std::uint64_t random) const {
  const double slope = se / ce;
  const std::size_t samples = column.ground.size();
  while (ground_at < samples && column.ground[ground_at] < kGroundStep * static_cast<double>(ground_at + 1) * slope)
    ++ground_at;
  Hit hit{1e9, -1};
  if (ground_at < samples) {
    // The ground is linear between two samples and flat before the first one.
    const double s1 = kGroundStep * static_cast<double>(ground_at + 1), z1 = column.ground[ground_at];
    const double s0 = s1 - kGroundStep, z0 = ground_at > 0 ? column.ground[ground_at - 1] : z1;
    const double above0 = s0 * slope - z0, above1 = s1 * slope - z1;
    const double share = above0 > above1 ? std::clamp(above0 / (above0 - above1), 0.0, 1.0) : 0.0;
    hit.distance = (s0 + share * kGroundStep) / ce;
  }
  for (const auto& upright : column.uprights) {
    const double z = upright.distance * slope;
    if (z >= upright.bottom && z <= upright.top && upright.distance < hit.distance * ce)
      hit = {upright.distance / ce, -1};
  }
  for (const auto& ball : column.balls) {
    if (slope < ball.lowest_tan || slope > ball.highest_tan) continue;
    const double along = ce * ball.along + se * ball.centre.z;
    const double up = ce * ball.centre.z - se * ball.along;
    const double inside = ball.radius * ball.radius - ball.off_squared - up * up;
    if (inside <= 0) continue;
    const double half = std::sqrt(inside);
    double distance = along - half;
    if (ball.sphere < 0) {
      random = scrambled(random);
      distance += -std::log((static_cast<double>(random >> 11) + 0.5) * 0x1p-53) / ball.density;
      if (distance > along + half) continue;
    }
    if (distance < hit.distance) hit = {distance, ball.sphere};
  }
  return hit;
}

void StaticScan::cast(std::uint32_t index, std::vector<float>& xyz, std::vector<SphereTruth>& truth) const {
  const auto patch = *std::prev(std::ranges::upper_bound(patches_, index, {}, &Patch::first_column));
  const std::vector<float>& normal = normal_table();
  Column column;
  prepare(patch.azimuth + patch.step * (index - patch.first_column), column);
  const double ca = column.cos_azimuth, sa = column.sin_azimuth;
  const Mat3 R_scanner_site = transposed(site_.R_site_scanner);
  truth.resize(site_.spheres.size());
  std::size_t ground_at = 0;
  const std::uint64_t seed =
      scrambled(site_.config.seed * 0x9E3779B9ull + static_cast<std::uint64_t>(site_.config.station));
  for (std::uint32_t row = 0; row < patch.rows; ++row) {
    const double elevation = patch.elevation + patch.step * row, ce = std::cos(elevation), se = std::sin(elevation);
    const std::uint64_t random = scrambled(seed ^ (static_cast<std::uint64_t>(index) << 32 | row));
    const Hit hit = nearest(column, ce, se, ground_at, random);
    if (hit.distance > config_.reach_m) continue;
    const Vec3 beam{ca * ce, sa * ce, se};
    double range = hit.distance + config_.range_precision_m * static_cast<double>(normal[random & 0xFFFF]);
    if (hit.sphere >= 0) {
      const StaticSphere& sphere = site_.spheres[static_cast<std::size_t>(hit.sphere)];
      SphereTruth& known = truth[static_cast<std::size_t>(hit.sphere)];
      ++known.hits;
      const Vec3 n = (1 / sphere.radius) * (hit.distance * beam - sphere.centre);
      const double c = dot(n, beam), across = hit.distance * config_.angle_sigma_rad;
      const double variance =
          c * c * config_.range_precision_m * config_.range_precision_m + (1 - c * c) * across * across;
      const double axes[] = {n.x, n.y, n.z};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) known.information[3 * i + k] += axes[i] * axes[k] / variance;
      range += sphere.common_range_error;
    }
    // The error is in the measured angles, not in the direction of the beam. To first order it is a step along azimuth
    // and elevation.
    const double azimuth_off = config_.angle_sigma_rad * static_cast<double>(normal[random >> 16 & 0xFFFF]);
    const double elevation_off = config_.angle_sigma_rad * static_cast<double>(normal[random >> 32 & 0xFFFF]);
    const Vec3 measured = beam + azimuth_off * Vec3{-sa, ca, 0} + elevation_off * Vec3{-ca * se, -sa * se, ce};
    const Vec3 p = R_scanner_site * (range * measured);
    xyz.push_back(static_cast<float>(p.x));
    xyz.push_back(static_cast<float>(p.y));
    xyz.push_back(static_cast<float>(p.z));
  }
}

Result<std::uint64_t> write_static_scan(const StaticScan& scan, const std::string& path, std::uint64_t most_points,
                                        unsigned threads, std::vector<SphereTruth>& truth) {
  ByteWriter file(path);
  constexpr std::uint32_t kTogether = 32;
  std::vector<std::vector<float>> parts(threads);
  std::vector<std::vector<SphereTruth>> truths(threads);
  std::uint64_t written = 0;
  for (std::uint32_t first = 0; first < scan.columns() && written < most_points; first += kTogether * threads) {
    {
      std::vector<std::jthread> helpers;
      for (unsigned t = 0; t < threads; ++t)
        helpers.emplace_back([&, t] {
          parts[t].clear();
          for (std::uint32_t c = first + t * kTogether; c < std::min(first + (t + 1) * kTogether, scan.columns()); ++c)
            scan.cast(c, parts[t], truths[t]);
        });
    }
    for (const auto& part : parts) {
      const auto points = std::min<std::uint64_t>(part.size() / 3, most_points - written);
      file.bytes(part.data(), static_cast<std::size_t>(12 * points));
      written += points;
    }
  }
  for (const auto& part : truths) {
    if (truth.size() < part.size()) truth.resize(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
      truth[i].hits += part[i].hits;
      for (std::size_t k = 0; k < 9; ++k) truth[i].information[k] += part[i].information[k];
    }
  }
  if (Status done = file.close(); !done.ok()) return done.error();
  return written;
}

double step_for_points(const StaticSite& site, const StaticScannerConfig& config, std::uint64_t points) {
  StaticScannerConfig coarse = config;
  coarse.step_deg = 0.5;
  coarse.window_step_deg = 0;
  const StaticScan scan(site, coarse);
  std::vector<float> xyz;
  std::vector<SphereTruth> truth;
  for (std::uint32_t i = 0; i < scan.columns(); ++i) scan.cast(i, xyz, truth);
  return coarse.step_deg * std::sqrt(static_cast<double>(xyz.size()) / 3 / static_cast<double>(points));
}

}  // namespace hueline::sim
