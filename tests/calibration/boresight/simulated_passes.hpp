#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "calibration/boresight/boresight.hpp"
#include "calibration/boresight/return_store.hpp"

namespace hueline::calibration::test {

/// A simulated drive along boxes on a plain. Its mountings and poses are known exactly.
struct PassesSetting {
  std::uint32_t seed = 1;
  double length_m = 120;   ///< length of the street, which runs north
  double speed = 8;        ///< m/s
  bool comes_back = true;  ///< the vehicle turns at the end and returns on the other side
  bool has_ground = true, has_houses = true;
  double rays_per_s = 3000;
  double sigma_range_m = 0.012;
  double outliers = 0;  ///< share of returns from moving objects or leaves
  double sigma_position_m = 0.01, sigma_level = 1.2e-4,
         /// Sigmas of the POS's slow errors (m, rad). The vertical position has 1.5 times as much.
      sigma_heading = 3.5e-4;
  double correlation_s = 90;
  double off_deg = 1;           ///< error of the measured rotation, about a random axis
  double off_lever_m = 0;       ///< error of the measured lever arm, in a random direction ...
  double sigma_lever_m = 0.02;  ///< ... or, if it is 0, with this sigma on each axis
  std::size_t scanners = 1;
};

struct SimulatedPasses {
  BoresightDrive drive;  ///< the mountings of its scanners are the measured ones
  std::vector<Transform<Body, Scanner>> truth;
};

/// Simulates a drive. `store` says which returns are kept.
SimulatedPasses simulate_passes(const PassesSetting& setting, const ReturnStore::Config& store = {});

/// Returns found minus true values of all scanners: rotations about Body's axes (rad), then the lever arm (m).
Eigen::VectorXd boresight_error(const Boresight& found, const SimulatedPasses& passes);

}  // namespace hueline::calibration::test
