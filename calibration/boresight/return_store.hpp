#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>

#include "calibration/boresight/boresight_drive.hpp"
#include "core/time.hpp"

namespace hueline::calibration {

/// Keeps of a drive's returns a bounded part that lies evenly in space and over the passes: of each cell of space, in
/// each stretch of the way, a few that a hash chooses. Two passes of a place keep as much of it as the place deserves,
/// however long the vehicle stood there. The same returns in the same order keep the same ones. Thread-bound.
class ReturnStore {
 public:
  struct Config {
    double near_m = 1.5;  ///< nearer ones are the vehicle itself
    double far_m = 35;    ///< farther ones say little of the lever arm, and edges are wide there
    double cell_m = 1;
    double stretch_m = 20;    ///< a stretch ends so far from where it began ...
    double stretch_deg = 30;  ///< ... or turned by so much
    int of_cell = 8;          ///< most returns of a cell in a stretch
    std::size_t most_returns =
        1'500'000;  ///< beyond, fewer of each cell are kept (to 4), then every other block of space is given up
    std::string validate() const;
  };
  /// `config.validate()` must be empty.
  ReturnStore(std::vector<BoresightScanner> scanners, const Config& config);

  /// Returns by time; those of several scanners may overtake each other by packets. Sigmas as the POS states them:
  /// east, north, up; roll, pitch, heading.
  void add(std::size_t scanner, const Eigen::Vector3f& p_scanner, GpsTime fired, const Transform<Enu, Body>& T_enu_body,
           const PosSigma& sigma);

  std::size_t offered() const { return offered_; }
  /// What was kept; the store is empty after it.
  BoresightDrive take();

 private:
  struct Kept {
    std::uint64_t priority;
    BoresightReturn one;
  };
  void step_way(const Transform<Enu, Body>& T_enu_body);
  void close_stretch();
  void thin();

  Config config_;
  BoresightDrive drive_;
  std::unordered_map<std::uint64_t, std::vector<Kept>> cells_;  // of the running stretch
  Eigen::Vector3d stretch_begin_ = Eigen::Vector3d::Zero();
  int of_cell_;
  std::uint8_t block_level_ = 0;  // of blocks one in 2^level is kept
  std::size_t offered_ = 0;
  GpsTime begin_{};
};

}  // namespace hueline::calibration
