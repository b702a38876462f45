#pragma once

#include <cstdint>
#include <string>

namespace hueline::sim {

/// How the emulated camera is connected: it decides the byte order of its registers, and the addresses of those that
/// are the same for all makers.
enum class CameraTransport : std::uint8_t { GigeVision, Usb3Vision };

/// Returns the GenICam description of the emulated camera (GenApi schema 1.0, names of the Standard Features Naming
/// Convention), which maps its features to registers. With `has_chunks` it offers exposure and gain of each image as
/// chunks. `max_packet_bytes` is the largest stream packet that a GigE Vision camera offers.
std::string camera_description(CameraTransport transport, bool has_chunks, std::uint32_t max_packet_bytes = 0);

}  // namespace hueline::sim
