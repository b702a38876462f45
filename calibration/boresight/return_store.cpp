#include "calibration/boresight/return_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace hueline::calibration {
namespace {

constexpr int kFewestOfCell = 4;
constexpr int kBlock = 4;  // in cells; thinning drops or keeps whole neighbourhoods
constexpr double kSigmaStep_s = 1;

/// The finaliser of splitmix64: every input bit changes every output bit.
std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

/// 21 bits for each axis are enough for 2000 km with cells of one metre.
std::uint64_t key_of(const Eigen::Vector3i& cell) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) key = key << 21 | (static_cast<std::uint64_t>(cell[i] + (1 << 20)) & 0x1FFFFF);
  return key;
}

}  // namespace

std::string ReturnStore::Config::validate() const {
  if (!(near_m >= 0 && near_m < far_m && far_m <= 200))
    return fmt::format("near_m and far_m are {} and {}; allowed: 0 or more, the second larger, at most 200 m", near_m,
                       far_m);
  if (!(cell_m >= 0.1 && cell_m <= 10)) return fmt::format("cell_m is {}; allowed: 0.1 to 10 m", cell_m);
  if (!(stretch_m >= 1 && stretch_m <= 1000)) return fmt::format("stretch_m is {}; allowed: 1 to 1000 m", stretch_m);
  if (!(stretch_deg >= 1 && stretch_deg <= 90))
    return fmt::format("stretch_deg is {}; allowed: 1 to 90 deg", stretch_deg);
  if (of_cell < kFewestOfCell || of_cell > 200)
    return fmt::format("of_cell is {}; allowed: {} to 200", of_cell, kFewestOfCell);
  if (most_returns < 10'000) return fmt::format("most_returns is {}; allowed: 10000 or more", most_returns);
  return {};
}

ReturnStore::ReturnStore(std::vector<BoresightScanner> scanners, const Config& config)
    : config_(config), of_cell_(config.of_cell) {
  drive_.scanners = std::move(scanners);
}

void ReturnStore::add(std::size_t scanner, const Eigen::Vector3f& p_scanner, GpsTime fired,
                      const Transform<Enu, Body>& T_enu_body, const PosSigma& sigma) {
  if (offered_++ == 0) begin_ = fired;
  const double range = static_cast<double>(p_scanner.norm());
  if (!(range >= config_.near_m && range <= config_.far_m)) return;
  step_path(T_enu_body);
  const double time_s = to_seconds(fired - begin_);
  if (drive_.sigmas.empty() || time_s >= drive_.sigmas.back().time_s + kSigmaStep_s)
    drive_.sigmas.push_back({time_s, sigma.position, sigma.attitude});
  const Point<Enu> p_enu =
      T_enu_body * (drive_.scanners[scanner].T_body_scanner * Point<Scanner>{p_scanner.cast<double>()});
  const std::uint64_t priority = scrambled(offered_);
  // A hash blurs the sides of the cells. A wall along the side of two cells would otherwise have a quota in each, and
  // its returns in the emptier cell would count for more.
  const Eigen::Vector3d blurred =
      p_enu.xyz / config_.cell_m + Eigen::Vector3d(static_cast<double>(priority & 0xFFFF),
                                                   static_cast<double>(priority >> 16 & 0xFFFF),
                                                   static_cast<double>(priority >> 32 & 0xFFFF)) /
                                       65536;
  const Eigen::Vector3i cell = blurred.array().floor().cast<int>();
  const Eigen::Vector3i block = (blurred / kBlock).array().floor().cast<int>();
  const auto block_level = static_cast<std::uint8_t>(std::countr_zero(scrambled(key_of(block)) | 1ULL << 40));
  if (block_level < block_level_) return;
  std::vector<Kept>& kept = cells_[key_of(cell)];
  auto place = kept.end();
  if (kept.size() == static_cast<std::size_t>(of_cell_)) {
    place = std::max_element(kept.begin(), kept.end(),
                             [](const Kept& a, const Kept& b) { return a.priority < b.priority; });
    if (place->priority < priority) return;
  } else {
    kept.emplace_back();
    place = std::prev(kept.end());
  }
  *place = {
      priority,
      {T_enu_body.translation, T_enu_body.rotation.cast<float>(), p_scanner, static_cast<float>(time_s),
       static_cast<std::uint32_t>(drive_.stretches.size() - 1), static_cast<std::uint16_t>(scanner), 0, block_level}};
}

void ReturnStore::step_path(const Transform<Enu, Body>& T_enu_body) {
  const double heading = attitude_from_enu_body(T_enu_body.rotation).heading;
  DriveStretch next{0, heading};
  if (!drive_.stretches.empty()) {
    const DriveStretch& running = drive_.stretches.back();
    const double far = (T_enu_body.translation - stretch_begin_).norm(),
                 turned = std::abs(std::remainder(heading - running.heading, 2 * std::numbers::pi));
    if (far < config_.stretch_m && turned < config_.stretch_deg * std::numbers::pi / 180) return;
    next.path_m = running.path_m + far;
    close_stretch();
  }
  stretch_begin_ = T_enu_body.translation;
  drive_.stretches.push_back(next);
}

void ReturnStore::close_stretch() {
  std::vector<std::uint64_t> keys;  // the order of the map depends on the standard library
  keys.reserve(cells_.size());
  for (const auto& [key, kept] : cells_) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  for (const std::uint64_t key : keys) {
    std::vector<Kept>& kept = cells_[key];
    std::sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) { return a.priority < b.priority; });
    for (std::size_t i = 0; i < kept.size(); ++i) {
      kept[i].one.rank = static_cast<std::uint8_t>(i);
      drive_.returns.push_back(kept[i].one);
    }
  }
  cells_.clear();
  while (drive_.returns.size() > config_.most_returns) thin();
}

void ReturnStore::thin() {
  if (of_cell_ / 2 >= kFewestOfCell) {
    of_cell_ /= 2;
    std::erase_if(drive_.returns, [&](const BoresightReturn& one) { return one.rank >= of_cell_; });
    return;
  }
  ++block_level_;
  std::erase_if(drive_.returns, [&](const BoresightReturn& one) { return one.block_level < block_level_; });
}

BoresightDrive ReturnStore::take() {
  close_stretch();
  BoresightDrive out = std::move(drive_);
  drive_ = {};
  drive_.scanners = out.scanners;
  of_cell_ = config_.of_cell;
  block_level_ = 0;
  offered_ = 0;
  return out;
}

}  // namespace hueline::calibration
