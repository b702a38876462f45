#pragma once

#include "config/rig.hpp"

namespace hueline::config {

/// Keys of a sensor with driver wheel: its bus, its messages and their signals.
WheelSensor read_wheel(Section& sensor);

}  // namespace hueline::config
