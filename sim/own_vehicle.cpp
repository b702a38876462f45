#include "sim/own_vehicle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hueline::sim {
namespace {

struct Box {
  Vec3 lo, hi;
};
// The parts suit the default mountings of scanner and camera. The body's origin is 0.8 m above the road.
constexpr std::array<Box, 8> kParts{{
    {{-0.90, -2.20, -0.55}, {0.90, 2.15, 0.22}},  // lower body
    {{-0.80, -2.10, 0.22}, {0.80, 0.75, 0.85}},   // cabin
    {{-0.55, -1.42, 0.85}, {0.55, -0.10, 0.93}},  // roof rack
    {{-0.02, -0.40, 0.93}, {0.08, -0.30, 1.74}},  // camera mast
    {{-0.06, -0.44, 1.74}, {0.12, -0.26, 1.95}},  // camera head
    {{-0.02, -1.32, 0.93}, {0.06, -1.24, 1.75}},  // scanner mast
    {{-0.04, -1.34, 1.76}, {0.08, -1.22, 1.90}},  // scanner
    {{-0.90, 0.75, 0.22}, {0.90, 1.10, 0.45}},    // foot of the windscreen
}};
constexpr double kReach = 3.2;  // every part is within this distance of (0, 0, 0.5), m

/// Returns true for nearly all rays that miss a box, and for none that meets it: products instead of quotients are
/// wrong by a few units of the last place. `inverse` is one divided by the direction; a zero in the direction decides
/// nothing here.
bool surely_misses(const Box& box, const std::array<double, 3>& from, const std::array<double, 3>& inverse) {
  constexpr double kSlack = 1e-6;  // share of the distances
  const std::array<double, 3> lo{box.lo.x, box.lo.y, box.lo.z}, hi{box.hi.x, box.hi.y, box.hi.z};
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    if (!std::isfinite(inverse[k])) continue;
    const double a = (lo[k] - from[k]) * inverse[k], b = (hi[k] - from[k]) * inverse[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return leave < enter * (1 - kSlack) - kSlack;
}

}  // namespace

std::optional<VehicleContact> own_vehicle_on_ray(Vec3 o, Vec3 d) {
  const Vec3 from = o - Vec3{0, 0, 0.5};
  const double ahead = dot(from, d), off2 = dot(from, from);
  if (off2 > kReach * kReach && (ahead > 0 || off2 - ahead * ahead > kReach * kReach)) return std::nullopt;
  double best = std::numeric_limits<double>::infinity();
  VehicleContact contact;
  const std::array<double, 3> op{o.x, o.y, o.z}, dp{d.x, d.y, d.z};
  const std::array<double, 3> inverse{1 / d.x, 1 / d.y, 1 / d.z};
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    if (surely_misses(kParts[i], op, inverse)) continue;
    const std::array<double, 3> lo{kParts[i].lo.x, kParts[i].lo.y, kParts[i].lo.z},
        hi{kParts[i].hi.x, kParts[i].hi.y, kParts[i].hi.z};
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    std::size_t axis = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (dp[k] == 0) {
        if (op[k] < lo[k] || op[k] > hi[k]) leave = -1;
        continue;
      }
      const double a = (lo[k] - op[k]) / dp[k], b = (hi[k] - op[k]) / dp[k];
      if (std::min(a, b) > enter) {
        enter = std::min(a, b);
        axis = k;
      }
      leave = std::min(leave, std::max(a, b));
    }
    if (enter < leave && enter > 0 && enter < best) {
      best = enter;
      std::array<double, 3> n{};
      n[axis] = dp[axis] > 0 ? -1 : 1;
      contact = {enter, {n[0], n[1], n[2]}, static_cast<int>(i)};
    }
  }
  if (best == std::numeric_limits<double>::infinity()) return std::nullopt;
  return contact;
}

}  // namespace hueline::sim
