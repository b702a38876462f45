#pragma once

#include <cstdint>
#include <string>

namespace hueline::sim {

/// Returns the GenICam description of the emulated camera (GenApi schema 1.0, names of the Standard Features Naming
/// Convention), which maps its features to registers. `max_packet_bytes` is the largest stream packet that it offers.
std::string camera_description(std::uint32_t max_packet_bytes);

}  // namespace hueline::sim
