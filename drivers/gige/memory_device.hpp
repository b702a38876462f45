#pragma once

#include <string>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/camera_memory.hpp"

namespace hueline::drivers {

/// Makes a device of Aravis from a memory and a description file, so that Aravis's GenICam finds, checks and sets the
/// features that lie in it. It opens no camera and has no stream. `memory` has to outlive it. Errors: Malformed, the
/// description cannot be read.
Result<GRef<ArvDevice>> make_memory_device(CameraMemory& memory, std::string description);

}  // namespace hueline::drivers
