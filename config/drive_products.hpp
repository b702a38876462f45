#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/keys.hpp"

/// The settings of products that are made of a recording: keys of the rig, for those that are made while the vehicle
/// drives, and options of the commands that make them.
namespace hueline::config {

/// How `hueline panorama` makes panoramas.
struct PanoramaKeys {
  std::string exposures = "all";  ///< read by ExposureChoice::parse()
  std::string size;               ///< read by width_px()
  std::string method = "depth", orientation = "heading", blend = "bands", gains = "even", vehicle = "fill";
  std::string fill = "64,64,64";  ///< read by fill_colour()
  double around_s = 4;
  std::string format = "jpeg";
  int quality = 92;

  void visit(Keys& keys);
  /// Returns the width that `size` says, in pixels; 0: what the lenses resolve. The height is half of it.
  std::uint32_t width_px() const;
  /// Returns red, green and blue of what no lens shows.
  std::array<std::uint8_t, 3> fill_colour() const;
};

/// How `hueline export --profile images` writes the images of the lenses.
struct ImageKeys {
  std::string exposures = "all";  ///< read by ExposureChoice::parse()
  std::string lens = "recorded";
  std::string format = "jpeg";
  int quality = 95;

  void visit(Keys& keys);
};

}  // namespace hueline::config
