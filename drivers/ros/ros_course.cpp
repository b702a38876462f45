#include "drivers/ros/ros_course.hpp"

#include <utility>

namespace hueline::drivers {

void RosCourse::add(UnixTime time, const Eigen::Quaterniond& q_enu_flu, const Eigen::Vector3d& velocity_enu) {
  constexpr double kLeastSpeed_mps = 1, kLeastLevel = 0.1;
  constexpr nanoseconds kLongestPause = std::chrono::seconds(3);
  const auto before = std::exchange(last_, time);
  if (!before || time <= *before || time - *before > kLongestPause) return;
  const Eigen::Vector2d velocity = velocity_enu.head<2>();
  const Eigen::Vector2d forward = (q_enu_flu * Eigen::Vector3d::UnitX()).head<2>();
  const double speed = velocity.norm();
  if (!(speed >= kLeastSpeed_mps) || !(forward.norm() >= kLeastLevel)) return;
  const Eigen::Vector2d c = velocity / speed, f = forward.normalized();
  const double way = speed * to_seconds(time - *before);
  way_m_ += way;
  turned_ += way * Eigen::Vector2d(f.x() * c.x() + f.y() * c.y(), f.y() * c.x() - f.x() * c.y());
  mirrored_ += way * Eigen::Vector2d(f.x() * c.x() - f.y() * c.y(), f.y() * c.x() + f.x() * c.y());
}

}  // namespace hueline::drivers
