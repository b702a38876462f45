#pragma once

#include <string>

namespace hueline::drivers {

/// Returns what to do if the kernel lets programs have little memory for transfers on USB
/// (usbcore.usbfs_memory_mb), as the end of a sentence. Empty if it is enough.
std::string hint_at_usb_memory();

}  // namespace hueline::drivers
