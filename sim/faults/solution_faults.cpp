// Errors of the solutions, made by the POS before it encodes anything.
#include <cmath>

#include "sim/faults/stages.hpp"
#include "sim/vec3.hpp"

namespace hueline::sim {
namespace {

constexpr double kMetresPerRadian = 6'378'137.0;  // an error of a few metres does not need the ellipsoid

void move_east(InsSample& sample, double metres) {
  sample.longitude_rad += metres / (kMetresPerRadian * std::cos(sample.latitude_rad));
}

void spoil(const FaultLine& line, double since_s, InsSample& sample) {
  switch (line.type) {
    case FaultType::CovarianceBlowUp:
      for (double& sigma : sample.sigma) sigma *= line.strength;
      break;
    case FaultType::AttitudeJump:
      sample.heading_rad = std::remainder(sample.heading_rad + radians(line.strength) - kPi, 2 * kPi) + kPi;
      break;
    case FaultType::PositionJump:
      move_east(sample, line.strength);
      break;
    case FaultType::GnssOutage: {
      const double off = line.strength * since_s * since_s / 2, too_fast = line.strength * since_s;
      move_east(sample, off);
      sample.velocity_east += too_fast;
      // The receiver knows how long it has had no satellites, but not the direction of its error.
      for (std::size_t i = 0; i < 3; ++i) {
        sample.sigma[i] = std::hypot(sample.sigma[i], off);
        sample.sigma[3 + i] = std::hypot(sample.sigma[3 + i], too_fast);
      }
      break;
    }
    default:
      break;
  }
}

}  // namespace

bool concerns_solutions(FaultType type) {
  return type == FaultType::PosGap || type == FaultType::CovarianceBlowUp || type == FaultType::AttitudeJump ||
         type == FaultType::PositionJump || type == FaultType::GnssOutage;
}

std::size_t spoil_solutions(const FaultLine& line, Drive& drive) {
  if (!concerns_solutions(line.type)) return 0;
  const auto is_inside = [&](const InsSample& sample) { return line.covers(sample.gps_ns - drive.begin_gps_ns); };
  if (line.type == FaultType::PosGap) return std::erase_if(drive.ins, is_inside);
  std::size_t hits = 0;
  for (InsSample& sample : drive.ins) {
    if (!is_inside(sample)) continue;
    ++hits;
    spoil(line, static_cast<double>(sample.gps_ns - drive.begin_gps_ns - line.begin_ns()) * 1e-9, sample);
  }
  return hits;
}

}  // namespace hueline::sim
