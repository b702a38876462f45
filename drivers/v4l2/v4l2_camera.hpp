#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/transport/file_descriptor.hpp"
#include "drivers/v4l2/v4l2_config.hpp"
#include "drivers/v4l2/v4l2_packet.hpp"

namespace hueline::drivers {

/// A video device that captures images.
struct V4l2Candidate {
  std::string path;      ///< /dev/video0
  std::string card;      ///< what the driver calls the camera
  std::string bus_info;  ///< where the driver says it is
  std::string serial;    ///< of a USB camera; else empty

  /// "/dev/video0 (vivid, platform:vivid-000)"
  std::string text() const;
};

/// Returns the capturing devices of this computer, by their numbers.
std::vector<V4l2Candidate> list_v4l2_cameras();

/// Returns the serial number that the USB device above `device_folder` states, or an empty text. `device_folder` is
/// what /sys/class/video4linux/videoN/device refers to.
std::string usb_serial_of(const std::string& device_folder);

/// A camera that is opened and set up, and does not stream yet.
struct V4l2Camera {
  FileDescriptor fd;
  std::string path;
  std::uint32_t buffer_type = 0;  ///< V4L2_BUF_TYPE_VIDEO_CAPTURE, or ..._MPLANE with one plane
  std::uint32_t image_bytes = 0;  ///< size of a buffer
  V4l2Header header;              ///< what is the same for all images

  bool is_multiplanar() const { return buffer_type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
};

/// Finds the camera that `config` names, opens it and sets format, rate and controls. Errors: Unavailable if it is
/// absent, or held by another program; Invalid if it is not the camera that `config` names, or does not take a setting.
/// The message then says what exists.
Result<V4l2Camera> open_v4l2_camera(const V4l2Config& config);

}  // namespace hueline::drivers
