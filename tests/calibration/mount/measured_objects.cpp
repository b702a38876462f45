#include "tests/calibration/mount/measured_objects.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "calibration/lens/lens_calibration.hpp"
#include "core/angle.hpp"
#include "tests/calibration/mount/simulated_points.hpp"

namespace hueline::calibration::test {
namespace {

/// Returns the point of the laser's surface at a pixel: the pixel's ray meets a plane through the returns that are
/// nearest to the pixel.
std::optional<Eigen::Vector3d> measure(const LensValues& lens, const Transform<Scanner, Lens>& T_scanner_lens,
                                       const std::vector<Eigen::Vector3d>& returns, const Eigen::Vector2d& pixel) {
  struct Near {
    double distance_px;
    Eigen::Vector3d p;
  };
  const auto T_lens_scanner = T_scanner_lens.inverse();
  std::vector<Near> near;
  for (const auto& p : returns)
    if (const auto seen = lens.project((T_lens_scanner * Point<Scanner>{p}).xyz))
      near.push_back({(*seen - pixel).norm(), p});
  constexpr std::size_t kUsed = 12;
  if (near.size() < kUsed) return std::nullopt;
  std::partial_sort(near.begin(), near.begin() + kUsed, near.end(),
                    [](const Near& a, const Near& b) { return a.distance_px < b.distance_px; });
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < kUsed; ++i) mean += near[i].p / static_cast<double>(kUsed);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < kUsed; ++i) spread += (near[i].p - mean) * (near[i].p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  const auto ray = lens.direction(pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d along = T_scanner_lens.rotation * *ray, from = T_scanner_lens.translation;
  return from + along * ((mean - from).dot(normal) / along.dot(normal));
}

}  // namespace

MeasuredObjects measure_objects(int count, int board_views, const MeasuringNoise& noise, std::uint32_t seed) {
  MeasuredObjects out;
  const fusion::CameraIntrinsics truth = plane_lens();
  const SimulatedBoards boards{.views = board_views, .seed = seed};
  const auto lens = calibrate_lens(boards.board, simulate_boards(truth, boards), truth.width, truth.height,
                                   {.model = LensModel::Brown});
  if (!lens.ok()) return out;
  const LensValues& found = lens->adjusted.lens;
  const Shot targets = simulate_points(truth, {.count = 20, .noise_px = 1, .noise_m = 0.005, .seed = seed});
  const auto mount = resect(found, targets.points, {.sigma_px = 1, .sigma_point_m = 0.005});
  if (!mount.ok()) return out;

  const fusion::CameraModel camera(truth);
  std::mt19937 random(seed + 17);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  // The scanner is level on the vehicle, so that its axes are those of Body.
  double plane2 = 0, height2 = 0;
  while (out.points < count) {
    const Eigen::Vector2d pixel(20 + uniform(random) * (truth.width - 41), 20 + uniform(random) * (truth.height - 41));
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    const Eigen::Vector3d object = (targets.T_scanner_lens * Point<Lens>{(4 + 26 * uniform(random)) * ray->xyz}).xyz;
    // A wall through the object, up to 50 degrees oblique, with a return every 8 cm.
    const Eigen::Vector3d facing = -object.normalized();
    const Eigen::Vector3d across = facing.unitOrthogonal();
    const Eigen::Quaterniond tilt(Eigen::AngleAxisd(50 * kRadPerDeg * (2 * uniform(random) - 1), across));
    const Eigen::Vector3d a = tilt * across, b = tilt * facing.cross(across);
    std::vector<Eigen::Vector3d> returns;
    for (int i = -6; i <= 6; ++i)
      for (int j = -6; j <= 6; ++j) {
        const Eigen::Vector3d p = object + 0.08 * ((i + uniform(random)) * a + (j + uniform(random)) * b);
        returns.push_back(p * (1 + noise.range_m * normal(random) / p.norm()));
      }
    const Eigen::Vector2d picked = pixel + noise.pick_px * Eigen::Vector2d(normal(random), normal(random));
    const auto measured = measure(found, mount->T_scanner_lens, returns, picked);
    if (!measured) continue;
    const Eigen::Quaterniond attitude(
        Eigen::AngleAxisd(-noise.heading_deg * kRadPerDeg * normal(random), Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(noise.roll_pitch_deg * kRadPerDeg * normal(random), Eigen::Vector3d::UnitX()) *
        Eigen::AngleAxisd(noise.roll_pitch_deg * kRadPerDeg * normal(random), Eigen::Vector3d::UnitY()));
    const Eigen::Vector3d error = attitude * *measured +
                                  noise.position_m * Eigen::Vector3d(normal(random), normal(random), normal(random)) -
                                  object;
    plane2 += error.head<2>().squaredNorm();
    height2 += error.z() * error.z();
    ++out.points;
  }
  out.plane_rms_m = std::sqrt(plane2 / out.points);
  out.height_rms_m = std::sqrt(height2 / out.points);
  return out;
}

}  // namespace hueline::calibration::test
