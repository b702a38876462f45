#pragma once

#include <cmath>
#include <numbers>

#include "core/coloured_point.hpp"

namespace hueline::test {

inline Geodetic sample_origin() { return {48.137 * std::numbers::pi / 180, 11.575 * std::numbers::pi / 180, 560.25}; }

/// Returns a ramp of points around the origin. Every field of a point differs from those of its neighbours.
inline CloudBlock sample_cloud(std::size_t count, std::size_t first = 0) {
  CloudBlock block{sample_origin(), {}};
  for (std::size_t i = first; i < first + count; ++i) {
    ColouredPoint p;
    const auto n = static_cast<double>(i);
    p.east = 100 * std::sin(n * 0.01) + n * 0.001;
    p.north = 300 * std::cos(n * 0.003);
    p.up = 3 * std::sin(n * 0.1) - 2;
    p.time = gps_time_ns(1'456'000'000'000'000'000ll + static_cast<std::int64_t>(i) * 2'304'001);
    p.exposure = i % 50 == 0 ? kNoExposure : static_cast<std::uint32_t>(i / 1000);
    p.u = static_cast<float>(i % 8000) + 0.25f;
    p.v = static_cast<float>(i % 4000) + 0.5f;
    p.red = static_cast<std::uint8_t>(i), p.green = static_cast<std::uint8_t>(i * 7),
    p.blue = static_cast<std::uint8_t>(i * 31);
    p.state = static_cast<ColourState>(i % 4);
    p.lens = static_cast<std::uint8_t>(i % 6);
    p.quality = static_cast<std::uint8_t>(255 - i % 256);
    p.moving = static_cast<std::uint8_t>(i * 13);
    p.reflectivity = static_cast<std::uint8_t>(i * 3);
    p.return_count = static_cast<std::uint8_t>(1 + i % 2);
    p.return_number = static_cast<std::uint8_t>(1 + (i / 2) % p.return_count);
    p.channel = static_cast<std::uint16_t>(i % 32);
    p.sensor = static_cast<SensorId>(1 + i % 3);
    p.sigma_m = 0.01f + static_cast<float>(i % 100) * 0.001f;
    block.points.push_back(p);
  }
  return block;
}

}  // namespace hueline::test
