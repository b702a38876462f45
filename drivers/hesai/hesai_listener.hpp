#pragma once

#include <memory>
#include <string>

#include "drivers/device_files.hpp"

namespace hueline::drivers {

/// Makes a listener that finds Hesai scanners in the capture file `path`. It tells their data packets by header, or by
/// flags and size. The directions of the beams are those of a calibration file: the one that is given, or the only one
/// beside the capture whose name has the model's. Without one they are nominal, and the device's note says so.
std::unique_ptr<CaptureListener> listen_for_hesai(const std::string& path);

}  // namespace hueline::drivers
