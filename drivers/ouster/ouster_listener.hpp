#pragma once

#include <memory>
#include <string>

#include "drivers/device_files.hpp"

namespace hueline::drivers {

/// Makes a listener that finds Ousters in the capture file `path`. Their packets are read with their metadata: those of
/// a file that is given, or else of the JSON files beside the capture whose name begins with the capture's, or else of
/// the only metadata beside it. Without metadata they are told as a model that is not known, with what is missing.
std::unique_ptr<CaptureListener> listen_for_ouster(const std::string& path);

}  // namespace hueline::drivers
