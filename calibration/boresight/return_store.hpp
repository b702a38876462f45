#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"
#include "core/time.hpp"

namespace hueline::calibration {

/// Keeps a bounded sample of a drive's returns that is even in space and over the passes. From each cell of space and
/// each stretch of the path it keeps a few returns, which a hash selects. A pass of a place therefore leaves the same
/// number of returns whether the vehicle drove by or stood there for a long time. The same returns in the same order
/// always give the same sample.
/// Thread safety: one thread per object.
class ReturnStore {
 public:
  struct Config {
    double near_m = 1.5;  ///< nearer returns are from the vehicle itself
    double far_m = 35;    ///< farther returns say little about the lever arm, and the beam is wide there
    double cell_m = 1;
    double stretch_m = 20;    ///< a stretch ends at this distance from its beginning ...
    double stretch_deg = 30;  ///< ... or when the vehicle has turned by this angle
    int of_cell = 8;          ///< most returns of a cell in a stretch
    /// Above this number the store first keeps fewer returns of each cell (down to 4), then drops every other block of
    /// space.
    std::size_t most_returns = 1'500'000;
    /// Returns the first wrong setting with its allowed range, or an empty text.
    std::string validate() const;
  };
  /// `config.validate()` must return an empty text.
  ReturnStore(std::vector<BoresightScanner> scanners, const Config& config);

  /// Adds a return. Returns come in the order of time; packets of several scanners may overlap. `sigma` is the
  /// uncertainty of the pose that the POS states: position east, north, up; attitude roll, pitch, heading. The function
  /// ignores `sigma.time_s`.
  void add(std::size_t scanner, const Eigen::Vector3f& p_scanner, GpsTime fired, const Transform<Enu, Body>& T_enu_body,
           const PosSigma& sigma);

  /// Returns how many returns were added, kept or not.
  std::size_t offered() const { return offered_; }
  /// Returns the sample and empties the store.
  BoresightDrive take();

 private:
  struct Kept {
    std::uint64_t priority;
    BoresightReturn one;
  };
  void step_path(const Transform<Enu, Body>& T_enu_body);
  void close_stretch();
  void thin();

  Config config_;
  BoresightDrive drive_;
  std::unordered_map<std::uint64_t, std::vector<Kept>> cells_;  // cells of the running stretch
  Eigen::Vector3d stretch_begin_ = Eigen::Vector3d::Zero();
  int of_cell_;
  std::uint8_t block_level_ = 0;  // one block in 2^level is kept
  std::size_t offered_ = 0;
  GpsTime begin_{};
};

}  // namespace hueline::calibration
