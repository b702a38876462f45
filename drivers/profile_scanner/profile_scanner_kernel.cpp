#include "drivers/profile_scanner/profile_scanner_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr double kUnitsPerMetre = 1e4;
constexpr float kMetre = 1e-4f;
constexpr double kFullTurn = 2 * std::numbers::pi;
constexpr double kAngleUnit = kFullTurn / 4294967296.0;
/// Unit of the upper 24 bits of an angle. A float holds them exactly, so an angle just below a turn stays below it.
constexpr float kCoarseAngleUnit = static_cast<float>(kFullTurn / 16777216.0);

std::uint32_t units(double angle) {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::llround(angle / kAngleUnit)));
}

/// Converts reflectance to reflectivity: matt surfaces have 0 to 100, retroreflectors more.
std::uint8_t reflectivity(std::uint32_t wire) {
  return static_cast<std::uint8_t>(wire <= 10'000 ? (wire + 50) / 100
                                                  : 100 + ((wire - 10'000) * 155 + 27'767) / 55'535);
}

}  // namespace

ProfileScannerKernel::ProfileScannerKernel(const ProfileScannerDecoder::Config& config)
    : nearest_(
          std::max<std::uint32_t>(1, static_cast<std::uint32_t>(std::llround(config.min_range_m * kUnitsPerMetre)))),
      span_(static_cast<std::uint32_t>(std::llround(config.max_range_m * kUnitsPerMetre)) - nearest_),
      window_begin_(units(config.angle_begin)) {
  double width = config.angle_end - config.angle_begin;
  if (width < 0) width += kFullTurn;
  window_width_ = width > kFullTurn - 2 * kAngleUnit ? 0xFFFFFFFFu : units(width);
}

void ProfileScannerKernel::fill_steps(std::int32_t step, std::size_t pulses) {
  if (step == step_ && pulses <= sin_.size()) return;
  step_ = step;
  sin_.resize(std::max(pulses, sin_.size()));
  cos_.resize(sin_.size());
  // Turns a unit vector step by step. The error is 1e-16 a step, so 1e-11 rad over the longest datagram.
  const double s = portable::sin(step * kAngleUnit), c = portable::cos(step * kAngleUnit);
  double x = 0, y = 1;
  for (std::size_t k = 0; k < sin_.size(); ++k) {
    sin_[k] = x;
    cos_[k] = y;
    const double turned = x * c + y * s;
    y = y * c - x * s;
    x = turned;
  }
}

void ProfileScannerKernel::decode(const ProfileData& data, std::vector<LaserReturn>& returns) {
  const std::size_t pulses = data.counts.size(), most = data.returns.size() / kProfileReturnBytes;
  fill_steps(data.angle_step, pulses);
  // Room for one more return than the datagram has, because a return is written before it is known whether it is kept.
  if (scratch_.size() <= most) scratch_.resize(most + 1);
  const double s = portable::sin(data.angle * kAngleUnit), c = portable::cos(data.angle * kAngleUnit);
  LaserReturn* out = scratch_.data();
  const std::byte* wire = data.returns.data();
  std::uint32_t angle = data.angle;
  std::uint64_t offset_ps = 500;  // half a nanosecond, so that the division rounds
  for (std::size_t k = 0; k < pulses;
       ++k, angle += static_cast<std::uint32_t>(data.angle_step), offset_ps += data.period_ps) {
    const auto count = static_cast<std::uint8_t>(data.counts[k]);
    if (count == 0) continue;
    const bool is_inside = angle - window_begin_ <= window_width_;
    const auto x = static_cast<float>(s * cos_[k] + c * sin_[k]), y = static_cast<float>(c * cos_[k] - s * sin_[k]);
    const float azimuth = static_cast<float>(angle >> 8U) * kCoarseAngleUnit;
    const auto offset_ns = static_cast<std::int32_t>(offset_ps / 1000);
    for (std::uint8_t number = 1; number <= count; ++number, wire += kProfileReturnBytes) {
      std::uint32_t range;
      std::uint16_t reflectance;
      std::memcpy(&range, wire, 4);
      std::memcpy(&reflectance, wire + 4, 2);
      const float range_m = static_cast<float>(range) * kMetre;
      out->x = x * range_m;
      out->y = y * range_m;
      out->z = 0;
      out->range_m = range_m;
      out->azimuth = azimuth;
      out->time_offset_ns = offset_ns;
      out->reflectivity = reflectivity(reflectance);
      out->return_number = number;
      out->return_count = count;
      out += is_inside && range - nearest_ <= span_ ? 1 : 0;
    }
  }
  returns.assign(scratch_.data(), out);
}

}  // namespace hueline::drivers
