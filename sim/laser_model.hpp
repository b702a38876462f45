#pragma once

#include <utility>
#include <vector>

#include "sim/rig_truth.hpp"
#include "sim/tone.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// One data packet and the truth of its returns. A firing without a return (no target, dropout) has no TrueReturn.
struct FiredPacket {
  LaserPacket packet;
  Vec3 scanner_enu;  ///< true place of the scanner at the packet's first firing, m
  std::vector<TrueReturn> returns;
};

/// Returns the pose at `share` of the way from `a` to `b`, which must be less than a millisecond apart. The chord of a
/// vehicle's turn differs from its arc by at most 1e-7 rad then, and by 1e-10 rad over the 55 us of a firing sequence.
Pose between(const Pose& a, const Pose& b, double share);

/// Returns whether the light that comes back suffices (LaserConfig::detection_range_m). Retroreflectors always do.
bool is_detected(const LaserConfig& config, const World::Ray& ray, const Seen& seen);

/// Computes the truth of a return for any kind of scanner. The scanner fills in time and channel. Thread-safe.
class ReturnTruth {
 public:
  ReturnTruth(const Scenario& scenario, const World& world);
  /// `wire_range_m` is the range as the packet can carry it.
  TrueReturn of(const World::Ray& ray, const Seen& seen, double wire_range_m) const;

 private:
  const World& world_;
  Tone tone_, unshaded_;
};

/// A Velodyne scanner. It fires each laser at its exact time from the exact pose. Thread-safe.
class Scanner {
 public:
  Scanner(const Scenario& scenario, const Motion& motion, const World& world);
  std::size_t packet_count() const { return packets_; }
  /// Returns packet `index` of the drive, which depends on nothing but the index.
  FiredPacket fire(std::size_t index) const;

  /// Returns the true azimuth at time `t`, hundredths of a degree, [0, 36000).
  double azimuth_centideg(GpsNs t) const;

 private:
  Scenario scenario_;
  const Motion& motion_;
  const World& world_;
  RigTruth rig_;
  LaserTiming timing_;
  ReturnTruth truth_;
  std::size_t packets_;
};

}  // namespace hueline::sim
