#pragma once

#include <utility>
#include <vector>

#include "sim/rig_truth.hpp"
#include "sim/tone.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// One data packet and the truth of its returns. Silent firings (no target, dropout) have no TrueReturn.
struct FiredPacket {
  LaserPacket packet;
  Vec3 scanner_enu;  ///< true place of the scanner at the packet's first firing
  std::vector<TrueReturn> returns;
};

/// A pose between two that are less than a millisecond apart: the chord of a vehicle's turn differs from its arc by
/// 1e-7 rad at most, over the 55 us of a firing sequence by 1e-10.
Pose between(const Pose& a, const Pose& b, double share);

/// What is true of a return, whatever scanner fired it; its time and channel are the scanner's to fill in. Thread-safe.
class ReturnTruth {
 public:
  ReturnTruth(const Scenario& scenario, const World& world);
  /// `wire_range_m`: as far as the wire can carry it.
  TrueReturn of(const World::Ray& ray, const Seen& seen, double wire_range_m) const;

 private:
  const World& world_;
  Tone tone_, unshaded_;
};

/// A Velodyne. Fires the scanner at the exact time of each laser from the exact pose. Thread-safe.
class Scanner {
 public:
  Scanner(const Scenario& scenario, const Motion& motion, const World& world);
  std::size_t packet_count() const { return packets_; }
  /// Packet `index` of the drive; depends on nothing but the index.
  FiredPacket fire(std::size_t index) const;

  /// True azimuth at an instant, hundredths of a degree, [0, 36000).
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
