#pragma once

#include <algorithm>

#include "storage/las_fields.hpp"
#include "storage/las_reader.hpp"
#include "storage/png.hpp"

namespace hueline::storage {

/// Chooses the colour in which each point of one LAS file is drawn.
class PointColour {
 public:
  /// `eight_bit`: the file holds 8-bit values in its 16-bit colours. This is common, though the format asks for scaled
  /// values.
  PointColour(const LasReader& reader, bool eight_bit, std::uint16_t brightest_intensity)
      : state_(reader.extra_field(las_extra_name<&ColouredPoint::state>())),
        colours_(reader.has_colour()),
        shift_(eight_bit ? 0 : 8),
        brightest_(brightest_intensity ? brightest_intensity : 1) {}

  /// Returns whether the point has a colour of its own, and is not drawn in grey.
  bool is_coloured(const LasPoint& p) const { return colours_ && (!state_ || LasReader::extra(p, *state_) < 2); }
  Rgb operator()(const LasPoint& p) const {
    if (is_coloured(p)) {
      const auto byte = [this](std::uint16_t v) { return static_cast<std::uint8_t>(v >> shift_); };
      return {byte(p.red), byte(p.green), byte(p.blue)};
    }
    const int grey = 60 + 120 * std::min<int>(p.intensity, brightest_) / brightest_;
    return {static_cast<std::uint8_t>(grey), static_cast<std::uint8_t>(grey), static_cast<std::uint8_t>(grey)};
  }

 private:
  const LasExtraField* state_;
  bool colours_;
  int shift_;
  std::uint16_t brightest_;
};

}  // namespace hueline::storage
