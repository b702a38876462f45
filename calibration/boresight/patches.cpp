#include "calibration/boresight/patches.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "calibration/boresight/plane_sums.hpp"

namespace hueline::calibration {
namespace {

constexpr int kFits = 4;
constexpr double kBeside = 4;  // how far into the neighbouring voxel a plane's returns are looked for, in gates
constexpr double kLeastSpread =
    0.12;  // least standard deviation of the returns along the plane's narrower axis, as a share of the voxel's width

struct Placed {
  std::uint64_t voxel;
  std::uint32_t one;
  bool operator<(const Placed& other) const { return voxel != other.voxel ? voxel < other.voxel : one < other.one; }
};

std::uint64_t voxel_of(const Eigen::Vector3d& p, double voxel_m) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i)
    key = key << 21 |
          (static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(p[i] / voxel_m)) + (1 << 20)) & 0x1FFFFF);
  return key;
}

/// Hashes a key. Any first part of a list in the order of the hash is evenly spread in space.
std::uint64_t shuffled(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

struct Plane {
  Eigen::Vector3d normal, centre, variance;
};

/// Fits the plane of the majority of the returns by robust weights.
Plane plane_of(const std::vector<Eigen::Vector3d>& placed, const PatchConfig& config,
               const std::vector<std::uint32_t>& returns) {
  // Squares of kilometres in double precision would lose the millimetres.
  const Eigen::Vector3d origin = placed[returns[0]];
  PlaneSums sums;
  for (const std::uint32_t i : returns) sums.add(placed[i] - origin, 1);
  Plane out;
  for (int round = 0;; ++round) {
    const auto axes = sums.axes();
    out = {axes.eigenvectors().col(0), sums.centre() + origin, axes.eigenvalues()};
    if (round == kFits) return out;
    sums = {};
    for (const std::uint32_t i : returns) {
      const double off = out.normal.dot(placed[i] - out.centre) / config.gate_m, keeps = 1 / (1 + off * off);
      sums.add(placed[i] - origin, keeps * keeps);
    }
  }
}

/// Returns whether the returns form a patch on `plane`, and removes the returns that are not near it.
bool keep_near(const BoresightDrive& drive, const std::vector<Eigen::Vector3d>& placed, const PatchConfig& config,
               const Plane& plane, Patch& patch) {
  const auto& [normal, centre, variance] = plane;
  if (!(variance[0] < config.flatness * variance[1] && variance[1] > std::pow(kLeastSpread * config.voxel_m, 2)))
    return false;
  std::size_t kept = 0;
  std::array<int, 256> of_pass{};
  for (std::size_t i = 0; i < patch.returns.size(); ++i) {
    if (!(std::abs(normal.dot(placed[patch.returns[i]] - centre)) < 3 * config.gate_m)) continue;
    patch.returns[kept] = patch.returns[i];
    patch.pass[kept++] = patch.pass[i];
    ++of_pass[patch.pass[i]];
  }
  if (static_cast<double>(kept) < config.least_share * static_cast<double>(patch.returns.size())) return false;
  patch.returns.resize(kept);
  patch.pass.resize(kept);
  if (std::count_if(of_pass.begin(), of_pass.end(), [&](int n) { return n >= config.fewest_of_pass; }) < 2)
    return false;
  // The returns are in the order of stretches and cells, so that taking every n-th one thins them evenly.
  if (kept > config.most_returns) {
    for (std::size_t i = 0; i < config.most_returns; ++i) {
      const std::size_t from = i * kept / config.most_returns;
      patch.returns[i] = patch.returns[from];
      patch.pass[i] = patch.pass[from];
    }
    patch.returns.resize(config.most_returns);
    patch.pass.resize(config.most_returns);
  }
  patch.normal_enu = normal;
  (drive.returns[patch.returns[0]].q_enu_body.cast<double>().conjugate() * normal).cwiseAbs().maxCoeff(&patch.facing);
  return true;
}

/// Keeps a third of the patches of each facing. What one facing does not use goes to the others.
void choose(std::vector<std::pair<std::uint64_t, Patch>>& found, std::size_t most) {
  std::array<std::size_t, 3> there{}, allowed{};
  for (const auto& [order, patch] : found) ++there[static_cast<std::size_t>(patch.facing)];
  std::size_t left = most;
  for (int round = 0; round < 3; ++round)
    for (std::size_t f = 0; f < 3; ++f) {
      const std::size_t more = std::min(there[f] - allowed[f], round == 0 ? most / 3 : left);
      allowed[f] += more;
      left -= more;
    }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::erase_if(found, [&](const auto& one) {
    std::size_t& room = allowed[static_cast<std::size_t>(one.second.facing)];
    return room == 0 || (--room, false);
  });
}

}  // namespace

std::vector<std::uint8_t> passes_of(const std::vector<std::uint32_t>& stretches, const std::vector<DriveStretch>& drive,
                                    const PatchConfig& config) {
  std::vector<std::uint8_t> out;
  std::uint8_t pass = 0;
  for (std::size_t i = 0, first = 0; i < stretches.size(); ++i) {
    const double turned =
        std::abs(std::remainder(drive[stretches[i]].heading - drive[stretches[first]].heading, 2 * std::numbers::pi)) *
        180 / std::numbers::pi;
    const bool is_new = i > 0 && (turned > config.pass_turn_deg ||
                                  drive[stretches[i]].path_m - drive[stretches[i - 1]].path_m > config.pass_gap_m);
    if (is_new && pass < 255) {
      ++pass;
      first = i;
    }
    out.push_back(pass);
  }
  return out;
}

PatchesFound find_patches(const BoresightDrive& drive, const std::vector<Eigen::Vector3d>& placed,
                          const PatchConfig& config) {
  std::vector<Placed> order(placed.size());
  for (std::uint32_t i = 0; i < placed.size(); ++i) order[i] = {voxel_of(placed[i], config.voxel_m), i};
  std::sort(order.begin(), order.end());
  PatchesFound out;
  std::vector<std::pair<std::uint64_t, Patch>> found;
  std::vector<std::uint32_t> own, stretches;
  for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
    const std::uint64_t voxel = order[from].voxel;
    own.clear();
    for (; to < order.size() && order[to].voxel == voxel; ++to) own.push_back(order[to].one);
    if (own.size() < static_cast<std::size_t>(config.fewest_of_pass)) continue;
    // The returns of a plane along a side of a voxel are in two voxels, separated by the sign of their error. The voxel
    // that has the plane's centre takes both parts.
    Eigen::Index axis = 0;
    plane_of(placed, config, own).normal.cwiseAbs().maxCoeff(&axis);
    const double low = std::floor(placed[own[0]][axis] / config.voxel_m) * config.voxel_m, high = low + config.voxel_m;
    for (const bool above : {false, true}) {
      const std::uint64_t one_on = 1ULL << (21 * (2 - axis)), beside = above ? voxel + one_on : voxel - one_on;
      for (auto it = std::lower_bound(order.begin(), order.end(), Placed{beside, 0});
           it != order.end() && it->voxel == beside; ++it)
        if (const double at = placed[it->one][axis];
            at > low - kBeside * config.gate_m && at < high + kBeside * config.gate_m)
          own.push_back(it->one);
    }
    if (own.size() < static_cast<std::size_t>(2 * config.fewest_of_pass)) continue;
    std::sort(own.begin(), own.end());
    stretches.clear();  // returns are in the order of stretches, so these are as well
    for (const std::uint32_t i : own)
      if (const std::uint32_t s = drive.returns[i].stretch; stretches.empty() || stretches.back() != s)
        stretches.push_back(s);
    const auto passes = passes_of(stretches, drive.stretches, config);
    if (passes.back() == 0) {
      ++out.seen_once;
      continue;
    }
    ++out.seen_twice;
    const Plane plane = plane_of(placed, config, own);
    if (!(plane.centre[axis] >= low && plane.centre[axis] < high)) continue;
    Patch patch;
    std::size_t s = 0;
    for (const std::uint32_t i : own) {
      while (stretches[s] != drive.returns[i].stretch) ++s;
      patch.returns.push_back(i);
      patch.pass.push_back(passes[s]);
    }
    if (keep_near(drive, placed, config, plane, patch)) found.emplace_back(shuffled(voxel), std::move(patch));
  }
  if (found.size() > config.most_patches) choose(found, config.most_patches);
  for (auto& one : found) out.patches.push_back(std::move(one.second));
  return out;
}

}  // namespace hueline::calibration
