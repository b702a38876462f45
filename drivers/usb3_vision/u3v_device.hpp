#pragma once

#include <string>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/usb3_vision/gencp.hpp"

namespace hueline::drivers {

/// Makes a device of Aravis from a camera's memory and its description file, so that Aravis's GenICam finds, checks and
/// sets the camera's features. It opens no camera and has no stream. `memory` has to outlive it. Errors: Malformed, the
/// description cannot be read.
Result<GRef<ArvDevice>> make_u3v_device(CameraMemory& memory, std::string description);

}  // namespace hueline::drivers
