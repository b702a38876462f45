#pragma once

#include <memory>

#include "core/packet.hpp"
#include "drivers/guest/guest_side.hpp"

namespace hueline::drivers {

/// Makes the source of a guest whose driver is `genicam`: U3vSource for a camera that is on USB when it is opened,
/// AravisSource for every other. The last will of a GigE camera lets it go. Errors: Malformed, Invalid (the settings).
Result<std::unique_ptr<PacketSource>> make_genicam_guest(guest::HostLink& link);

}  // namespace hueline::drivers
