#pragma once

#include <cstdint>
#include <vector>

#include "core/stamped.hpp"
#include "fusion/georeference.hpp"

namespace hueline::fusion {

/// A batch whose returns have their places.
struct PlacedBatch {
  StampedLaserBatch batch;
  GeoreferencedBatch placed;
  GpsTime last{};            ///< its last firing
  std::uint64_t number = 0;  ///< in the order of placing
  /// The turn that it belongs to, and for each placed return the point of that turn's skin that stands for it (see
  /// Visibility). Empty until the turn is complete.
  std::uint64_t turn = 0;
  std::vector<std::uint32_t> on_skin;
};

}  // namespace hueline::fusion
