#pragma once

#include <memory>

#include "core/packet.hpp"
#include "drivers/guest/guest_side.hpp"

namespace hueline::drivers {

/// The camera that `link.config()` describes, with images in the memory shared with the host and the release of the
/// camera as last will.
Result<std::unique_ptr<PacketSource>> make_aravis_guest(guest::HostLink& link);

}  // namespace hueline::drivers
