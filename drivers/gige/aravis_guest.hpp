#pragma once

#include <memory>

#include "core/packet.hpp"
#include "drivers/guest/guest_side.hpp"

namespace hueline::drivers {

/// Makes the camera that `link.config()` describes. Its images lie in the memory that is shared with the host. For a
/// GigE camera it gives the host a last will that releases the camera.
Result<std::unique_ptr<PacketSource>> make_aravis_guest(guest::HostLink& link);

}  // namespace hueline::drivers
