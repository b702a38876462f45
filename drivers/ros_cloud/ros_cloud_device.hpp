#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The scanner behind point clouds of ROS. It cannot be captured: a packet is a message of a recording.
extern const DeviceType kRosCloud;

}  // namespace hueline::drivers
