#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/usb3_vision/gencp.hpp"

/// The registers that every USB3 Vision camera has at the same places: ABRM (GenCP 1.3), SBRM and SIRM (USB3 Vision
/// 1.0). All others are described by the camera's own file, which lies in its memory.
namespace hueline::drivers {

/// Where a camera's other registers lie, and what it can take.
struct U3vBootstrap {
  std::uint64_t manifest = 0;  ///< address of the table of description files
  std::uint64_t stream = 0;    ///< address of the registers of the image stream (SIRM)
  GencpClient::Limits limits;
};
/// Reads them. Errors: Unsupported, the camera has no image stream; those of the memory.
Result<U3vBootstrap> read_bootstrap(CameraMemory& camera);

/// Reads the camera's description file (GenApi XML), and unpacks it if it is a ZIP file. Errors: Malformed, there is
/// none, or it cannot be unpacked; those of the memory.
Result<std::string> read_description(CameraMemory& camera, std::uint64_t manifest);
/// Returns the only file, or the first, of a ZIP file. Errors: Malformed.
Result<std::string> unzip(const std::string& archive);

/// How the camera divides an image for the endpoint of its stream.
struct U3vStreamShape {
  std::size_t payload_bytes = 0, padding_bytes = 0;  ///< of one image, and what fills it up to the camera's alignment
  /// The transfers of one image: leader, payload, trailer; multiples of the packet size.
  std::vector<std::size_t> transfer_bytes;
};
/// Tells the camera, which is set up and does not stream, in which pieces the computer asks for an image. Errors:
/// Malformed, the camera's sizes make no sense; those of the memory.
Result<U3vStreamShape> set_up_stream(CameraMemory& camera, std::uint64_t stream, std::size_t packet_bytes);
/// Turns the stream on or off. Errors: those of the memory.
Status set_streaming(CameraMemory& camera, std::uint64_t stream, bool is_on);

}  // namespace hueline::drivers
