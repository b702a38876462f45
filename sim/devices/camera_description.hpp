#pragma once

#include <cstdint>
#include <string>

namespace hueline::sim {

/// The GenICam description (GenApi schema 1.0, names of the Standard Features Naming Convention) of the emulated
/// camera: which register each feature is. `max_packet_bytes`: the largest stream packet that it offers.
std::string camera_description(std::uint32_t max_packet_bytes);

}  // namespace hueline::sim
