#pragma once

#include <cstdint>
#include <vector>

#include "sim/laser_model.hpp"
#include "sim/rig_truth.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// One data datagram of a profile scanner and the truth of its returns. A pulse without a target has no TrueReturn.
struct FiredProfile {
  ProfilePacket packet;
  Vec3 scanner_enu;  ///< true place of the scanner at the first pulse, m
  std::vector<TrueReturn> returns;
};

/// A scanner with a rotating mirror. Its beam sweeps the plane across the mirror's axis (z of the scanner's frame);
/// each pulse leaves at its exact time from the exact pose. True angles are whole numbers of the wire's unit.
/// Thread-safe.
class ProfileScanner {
 public:
  ProfileScanner(const Scenario& scenario, const Motion& motion, const World& world);
  std::size_t packet_count() const { return packets_; }
  /// Returns datagram `index` of the drive, which depends on nothing but the index.
  FiredProfile fire(std::size_t index) const;

 private:
  Scenario scenario_;
  const Motion& motion_;
  const World& world_;
  RigTruth rig_;
  ProfileTiming timing_;
  ReturnTruth truth_;
  std::size_t packets_ = 0;
};

}  // namespace hueline::sim
