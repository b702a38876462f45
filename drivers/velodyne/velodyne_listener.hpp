#pragma once

#include <memory>
#include <string>

#include "drivers/device_files.hpp"

namespace hueline::drivers {

/// Makes a listener that finds Velodyne scanners in the capture file `path`. It tells their datagrams by the size, and
/// the model by the last factory byte of a data packet. Where that byte leaves the model open, it reads the sender's
/// first packets in the file and goes by their timing (VelodyneTiming).
std::unique_ptr<CaptureListener> listen_for_velodyne(const std::string& path);

}  // namespace hueline::drivers
