#pragma once

#include <numbers>

/// Conversion between degrees, which files and people use, and radians, which the program calculates in.
namespace hueline {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;
inline constexpr double kDegPerRad = 180 / std::numbers::pi;

}  // namespace hueline
