#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "core/time.hpp"

namespace hueline::drivers {

/// How the body lies to the way that it drives. A vehicle drives to where its x axis points; orientations of another
/// world than REP 103's, or of an inertial sensor that does not know north, show by this alone.
/// Means are weighted by the way. They are vectors of at most length 1, which is reached by an angle that stays the
/// same; angles that are spread over the circle give 0.
class RosCourse {
 public:
  /// Takes a pose, in the order of time. Poses slower than 1 m/s, whose course is noise, are left out.
  void add(UnixTime time, const Eigen::Quaterniond& q_enu_flu, const Eigen::Vector3d& velocity_enu);
  double way_m() const { return way_m_; }
  /// The direction of the body's x axis, seen from the direction in which it drives: x ahead, y to the left.
  Eigen::Vector2d turned() const { return mean(turned_); }
  /// The sum of both directions: it stays the same if the body turns to the right where it drives to the left.
  Eigen::Vector2d mirrored() const { return mean(mirrored_); }

 private:
  Eigen::Vector2d mean(const Eigen::Vector2d& sum) const { return way_m_ > 0 ? sum / way_m_ : sum; }

  std::optional<UnixTime> last_;
  double way_m_ = 0;
  Eigen::Vector2d turned_ = Eigen::Vector2d::Zero(), mirrored_ = Eigen::Vector2d::Zero();
};

}  // namespace hueline::drivers
