#pragma once

#include "core/time.hpp"

namespace hueline::drivers {

/// A scanner's decoder gives a label up to this time after its second. Later the next second may begin before the
/// packet arrives.
constexpr nanoseconds kLabelTo = std::chrono::milliseconds(900);

}  // namespace hueline::drivers
