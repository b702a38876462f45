#pragma once

#include "core/time.hpp"

namespace hueline::survey {

/// How much later than the laser of its moment an exposure may come, while sync learns a camera's relation.
constexpr nanoseconds kLatestExposure{8'000'000'000};

}  // namespace hueline::survey
