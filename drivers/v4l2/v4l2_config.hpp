#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/time.hpp"
#include "drivers/v4l2/v4l2_control.hpp"

namespace hueline::drivers {

/// The settings of a V4L2 camera: which one it is, how it is set, and how many images may be held.
struct V4l2Config {
  // Which camera. All that are set must fit.
  std::string device;    ///< path: /dev/v4l/by-id/..., /dev/video0
  std::string bus_info;  ///< the driver's name of the place: "usb-0000:00:14.0-2"
  std::string serial;    ///< serial number of a USB camera

  std::uint32_t width = 0, height = 0;  ///< pixels
  std::uint32_t fourcc = 0;             ///< pixel format, one of v4l2_formats()
  double frame_rate_hz = 0;             ///< 0: the camera's own
  std::optional<nanoseconds> exposure{};
  std::vector<V4l2Setting> controls;  ///< set in this order

  /// Buffers that the driver always has, and images that the recorder and the pipeline may hold beside them.
  std::size_t stream_buffers = 4, images_in_flight = 28;
  /// Whether images stay in the driver's buffers until nobody needs them. If false, each is copied once.
  bool zero_copy = true;

  void visit(Keys& keys);
  KeyError validate() const;
};

}  // namespace hueline::drivers
