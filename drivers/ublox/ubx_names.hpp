#pragma once

#include <cstdint>
#include <string>

namespace hueline::drivers {

/// Returns u-blox's name of a message, such as "NAV-PVT"; "UBX-0D-7F" for one that the interface descriptions do not
/// name.
std::string ubx_name(std::uint8_t message_class, std::uint8_t id);

}  // namespace hueline::drivers
