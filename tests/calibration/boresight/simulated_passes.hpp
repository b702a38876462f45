#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "calibration/boresight/boresight.hpp"
#include "calibration/boresight/return_store.hpp"

namespace hueline::calibration::test {

/// A made-up drive along boxes on a plain, whose mounting and poses are known exactly.
struct PassesSetting {
  std::uint32_t seed = 1;
  double length_m = 120;   ///< of the street, which runs north
  double speed = 8;        ///< m/s
  bool comes_back = true;  ///< turns at the end and returns on the other side
  bool has_ground = true, has_houses = true;
  double rays_per_s = 3000;
  double sigma_range_m = 0.012;
  double outliers = 0;  ///< share of returns from things that move, or from leaves
  double sigma_position_m = 0.01, sigma_level = 1.2e-4,
         sigma_heading = 3.5e-4;  ///< of the POS's slow errors (rad); the up axis has 1.5 times as much
  double correlation_s = 90;
  double off_deg = 1;           ///< the measured rotation, about a random axis
  double off_lever_m = 0;       ///< the measured lever arm, in a random direction ...
  double sigma_lever_m = 0.02;  ///< ... or, where that is 0, with this sigma on each axis
  std::size_t scanners = 1;
};

struct SimulatedPasses {
  BoresightDrive drive;  ///< its scanners' mountings are the measured ones
  std::vector<Transform<Body, Scanner>> truth;
};

/// `store`: what of the returns is kept.
SimulatedPasses simulate_passes(const PassesSetting& setting, const ReturnStore::Config& store = {});

/// Found less true: turns about Body's axes (rad), then the lever arm (m); of all scanners.
Eigen::VectorXd boresight_error(const Boresight& found, const SimulatedPasses& passes);

}  // namespace hueline::calibration::test
