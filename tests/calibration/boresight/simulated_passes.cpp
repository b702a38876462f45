#include "tests/calibration/boresight/simulated_passes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hueline::calibration::test {
namespace {

constexpr double kPi = std::numbers::pi;

struct Box {
  Eigen::Vector3d low, high;
};

/// Houses on both sides with gaps and bays, and objects parked at the kerb.
std::vector<Box> street(const PassesSetting& setting, std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Box> out;
  for (const double side : {-1.0, 1.0})
    for (double y = -20; y < setting.length_m + 20;) {
      const double wide = 7 + 8 * share(random), front = 7 + 2 * share(random), deep = 8, high = 6 + 6 * share(random);
      const double x0 = side > 0 ? front : -front - deep;
      if (setting.has_houses) {
        out.push_back({{x0, y, 0}, {x0 + deep, y + wide, high}});
        const double bay = 1 + 0.5 * share(random);
        out.push_back({{side > 0 ? front - bay : -front, y + 2, 0}, {side > 0 ? front : -front + bay, y + 4, 4}});
      }
      if (setting.has_houses && share(random) < 0.5)
        out.push_back({{side * 5.2 - 0.9, y + 1, 0.3}, {side * 5.2 + 0.9, y + 5.2, 1.5}});
      y += wide + (share(random) < 0.5 ? 0.0 : 3.0);
    }
  return out;
}

double hit(const Box& box, const Eigen::Vector3d& from, const Eigen::Vector3d& inverse) {
  double in = 0, out = 1e9;
  for (int i = 0; i < 3; ++i) {
    const double a = (box.low[i] - from[i]) * inverse[i], b = (box.high[i] - from[i]) * inverse[i];
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  return in < out ? in : 1e9;
}

/// Returns the pose on the path: north on the right side, a half circle, south on the other side.
Transform<Enu, Body> pose_at(double way, double time, const PassesSetting& setting) {
  constexpr double kLane = 2.5;
  const double arc = kPi * kLane;
  Eigen::Vector3d p(kLane, way, 0.8);
  double heading = 0;
  if (setting.comes_back && way > setting.length_m) {
    const double around = std::min(1.0, (way - setting.length_m) / arc) * kPi;
    p = {kLane * std::cos(around),
         setting.length_m + kLane * std::sin(around) - std::max(0.0, way - setting.length_m - arc), 0.8};
    heading = -around;  // to the left
  }
  const Attitude attitude{0.006 * std::sin(1.3 * time), 0.004 * std::sin(0.9 * time + 1), heading};
  return {rotation_enu_body(attitude), p};
}

}  // namespace

SimulatedPasses simulate_passes(const PassesSetting& setting, const ReturnStore::Config& store_config) {
  std::mt19937_64 random(setting.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0, 1);
  const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
  const auto turned = [](const Eigen::Vector3d& by) {
    return Eigen::Quaterniond(
        Eigen::AngleAxisd(by.norm(), by.norm() > 0 ? Eigen::Vector3d(by.normalized()) : Eigen::Vector3d::UnitX()));
  };
  const std::vector<Box> boxes = street(setting, random);
  SimulatedPasses out;
  std::vector<BoresightScanner> measured;
  for (std::size_t i = 0; i < setting.scanners; ++i) {
    Transform<Body, Scanner> T;
    const double tilt = i == 0 ? 28 : -35;
    T.rotation = Eigen::AngleAxisd((i == 0 ? -0.9 : 88) * kPi / 180, Eigen::Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(tilt * kPi / 180, Eigen::Vector3d::UnitX());
    T.translation = i == 0 ? Eigen::Vector3d(0.02, -1.28, 1.83) : Eigen::Vector3d(-0.5, 0.9, 1.7);
    out.truth.push_back(T);
    BoresightScanner scanner{i == 0 ? "laser" : "second", T, setting.sigma_range_m};
    scanner.T_body_scanner.rotation = (turned(direction() * (setting.off_deg * kPi / 180)) * T.rotation).normalized();
    scanner.T_body_scanner.translation +=
        setting.off_lever_m > 0
            ? Eigen::Vector3d(direction() * setting.off_lever_m)
            : Eigen::Vector3d(Eigen::Vector3d(normal(random), normal(random), normal(random)) * setting.sigma_lever_m);
    measured.push_back(scanner);
  }
  ReturnStore store(measured, store_config);
  Eigen::Matrix<double, 6, 1> sigma, error;
  sigma << setting.sigma_position_m, setting.sigma_position_m, 1.5 * setting.sigma_position_m, setting.sigma_level,
      setting.sigma_level, setting.sigma_heading;
  for (int i = 0; i < 6; ++i) error[i] = sigma[i] * normal(random);
  const PosSigma stated{0, sigma.head<3>(), sigma.tail<3>()};
  const double step = 1 / setting.rays_per_s, keep = std::exp(-step / setting.correlation_s),
               fresh = std::sqrt(1 - keep * keep);
  const double way_end = setting.comes_back ? 2 * setting.length_m + 2.5 * kPi : setting.length_m;
  for (double time = 0; time * setting.speed < way_end; time += step) {
    for (int i = 0; i < 6; ++i) error[i] = keep * error[i] + fresh * sigma[i] * normal(random);
    const auto T_true = pose_at(time * setting.speed, time, setting);
    const Transform<Enu, Body> T_pos{T_true.rotation * turned(-error.tail<3>()), T_true.translation - error.head<3>()};
    const std::size_t scanner = static_cast<std::size_t>(time * setting.rays_per_s) % setting.scanners;
    const double azimuth = 2 * kPi * share(random), elevation = (-15 + 2 * std::floor(16 * share(random))) * kPi / 180;
    const Eigen::Vector3d ray(std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
                              std::sin(elevation));
    const auto T_enu_scanner = T_true * out.truth[scanner];
    const Eigen::Vector3d along = T_enu_scanner.rotation * ray;
    const Eigen::Vector3d inverse = along.cwiseInverse();
    double range = setting.has_ground && along.z() < 0 ? -T_enu_scanner.translation.z() / along.z() : 1e9;
    for (const Box& box : boxes) range = std::min(range, hit(box, T_enu_scanner.translation, inverse));
    if (range > 60) continue;
    if (share(random) < setting.outliers) range *= 0.4 + 0.6 * share(random);
    range += setting.sigma_range_m * normal(random);
    store.add(scanner, (ray * range).cast<float>(), gps_time_ns(1'000'000'000'000'000'000) + from_seconds(time), T_pos,
              stated);
  }
  out.drive = store.take();
  return out;
}

Eigen::VectorXd boresight_error(const Boresight& found, const SimulatedPasses& passes) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(6 * found.scanners.size()));
  for (std::size_t s = 0; s < found.scanners.size(); ++s) {
    const Eigen::AngleAxisd off(found.scanners[s].T_body_scanner.rotation * passes.truth[s].rotation.conjugate());
    out.segment<3>(static_cast<Eigen::Index>(6 * s)) = off.axis() * std::remainder(off.angle(), 2 * kPi);
    out.segment<3>(static_cast<Eigen::Index>(6 * s + 3)) =
        found.scanners[s].T_body_scanner.translation - passes.truth[s].translation;
  }
  return out;
}

}  // namespace hueline::calibration::test
