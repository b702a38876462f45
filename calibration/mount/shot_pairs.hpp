#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "calibration/lens/lens_values.hpp"
#include "core/frames.hpp"

/// What a laser cloud says about the image of the same moment: pairs of neighbouring directions between which the image
/// should change, or should not. All functions are pure.
namespace hueline::calibration {

/// What the laser sees between the two ends of a pair. The reflectivity changes along a ring on one surface; an outline
/// is the border of something near in front of something far, or in front of nothing that returns.
enum class PairKind : std::uint8_t {
  Even,           ///< the same surface, about the same reflectivity
  Brighter,       ///< the second end reflects more
  MuchBrighter,   ///< see Brighter
  Darker,         ///< the second end reflects less
  MuchDarker,     ///< see Darker
  OutlineBeside,  ///< the second end is beside the outline of the first, in the same ring
  OutlineAcross,  ///< the same, in the next ring above or below
  OutlineOpen,    ///< the same, where the ring has no return
};
constexpr int kPairKinds = 8;

/// Number of columns and rows of blocks into which the image is cut.
constexpr int kPairColumns = 6, kPairRows = 4;
/// Number of parts of a scene: each block, near and far.
constexpr int kPairParts = 2 * kPairColumns * kPairRows;

/// Two directions from the lens, one laser step apart.
struct LaserPair {
  Eigen::Vector3f first, second;  ///< points of the lens frame, m
  PairKind kind = PairKind::Even;
  std::uint8_t part = 0;  ///< 2 * (row * kPairColumns + column) + 1 if it is farther than half of all pairs
};

/// The pairs of a cloud.
struct LaserPairs {
  std::vector<LaserPair> pairs;
  double step = 0;  ///< median angle between neighbouring returns of a ring, rad
};

/// Returns the pairs that fall into the image of a lens or beside it. `p_scanner` are the returns in the scanner's
/// frame, with the scanner in its origin, in any order. `intensity` has a value for each, of any scale. Returns hidden
/// from the lens by something nearer are left out. Neighbours are found by their direction, so that the cloud needs no
/// rings.
LaserPairs laser_pairs(const std::vector<Eigen::Vector3f>& p_scanner, const std::vector<float>& intensity,
                       const Transform<Lens, Scanner>& T_lens_scanner, const LensValues& lens, double max_angle);

}  // namespace hueline::calibration
