#include "tests/calibration/mount/simulated_points.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace hueline::calibration::test {

Shot simulate_points(const fusion::CameraIntrinsics& lens, const SimulatedPoints& what) {
  const fusion::CameraModel camera(lens);
  std::mt19937 random(what.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  Shot out;
  out.T_scanner_lens.rotation =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  out.T_scanner_lens.translation = 0.3 * Eigen::Vector3d(normal(random), normal(random), normal(random));
  while (static_cast<int>(out.points.size()) < what.count) {
    const Eigen::Vector2d pixel(uniform(random) * (lens.width - 1), uniform(random) * (lens.height - 1));
    const Eigen::Vector2d from_middle(2 * pixel.x() / (lens.width - 1) - 1, 2 * pixel.y() / (lens.height - 1) - 1);
    if (from_middle.lpNorm<Eigen::Infinity>() < what.innermost) continue;
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    const bool is_near = static_cast<int>(out.points.size()) < what.near;
    const double from = what.near < 0 || is_near ? what.nearest_m : what.farthest_m / 2,
                 to = is_near ? 2 * what.nearest_m : what.farthest_m;
    const double distance = from * std::pow(to / from, uniform(random));
    Correspondence point;
    point.name = std::to_string(out.points.size() + 1);
    point.p_scanner = (out.T_scanner_lens * Point<Lens>{distance * ray->xyz}).xyz +
                      what.noise_m * Eigen::Vector3d(normal(random), normal(random), normal(random));
    point.pixel = pixel + what.noise_px * Eigen::Vector2d(normal(random), normal(random));
    out.points.push_back(point);
  }
  return out;
}

Eigen::Matrix<double, 6, 1> pose_error(const Transform<Scanner, Lens>& found, const Transform<Scanner, Lens>& truth) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(found.rotation.conjugate() * truth.rotation));
  Eigen::Matrix<double, 6, 1> out;
  const double angle = std::remainder(turn.angle(), 2 * 3.14159265358979323846);
  out << -angle * turn.axis(), found.translation - truth.translation;
  return out;
}

}  // namespace hueline::calibration::test
