#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "calibration/targets/station_orientation.hpp"
#include "sim/static_scan/static_scanner.hpp"

namespace hueline::calibration {

/// A scan in memory, in blocks.
class MemoryScan : public ScanBlocks {
 public:
  explicit MemoryScan(std::vector<float> xyz, std::size_t block_points = 50'000)
      : xyz_(std::move(xyz)), block_points_(block_points) {}
  std::size_t blocks() const override { return (xyz_.size() / 3 + block_points_ - 1) / block_points_; }
  Result<std::span<const float>> block(std::size_t index, std::vector<std::byte>&) const override {
    const std::size_t begin = 3 * index * block_points_;
    return std::span<const float>(xyz_).subspan(begin, std::min(3 * block_points_, xyz_.size() - begin));
  }
  std::vector<float>& xyz() { return xyz_; }

 private:
  std::vector<float> xyz_;
  std::size_t block_points_;
};

inline Eigen::Vector3d eigen(const sim::Vec3& v) { return {v.x, v.y, v.z}; }

/// A station with its truth in the simulator and with what the program gets of it.
struct SimulatedStation {
  std::shared_ptr<const sim::StaticSite> site;
  std::vector<sim::SphereTruth> truth;
  std::vector<float> xyz;

  std::vector<SurveyedTarget> targets() const {
    std::vector<SurveyedTarget> out;
    for (std::size_t i = 0; i < site->spheres.size(); ++i) {
      const sim::StaticSphere& sphere = site->spheres[i];
      if (sphere.kind != sim::SphereKind::Decoy)
        out.push_back({sphere.name,
                       {eigen(site->surveyed[i])},
                       site->config.survey_sigma_m,
                       sphere.radius,
                       sphere.kind == sim::SphereKind::Check,
                       {site->name}});
    }
    return out;
  }
  SurveyedStation station() const { return {site->name, {eigen(site->surveyed_place)}, {}, {}}; }
};

inline SimulatedStation simulate_station(const sim::StaticSiteConfig& config, const sim::StaticScannerConfig& scanner) {
  SimulatedStation out;
  out.site = std::make_shared<sim::StaticSite>(sim::make_static_site(config));
  const sim::StaticScan scan(*out.site, scanner);
  for (std::uint32_t i = 0; i < scan.columns(); ++i) scan.cast(i, out.xyz, out.truth);
  return out;
}

}  // namespace hueline::calibration
