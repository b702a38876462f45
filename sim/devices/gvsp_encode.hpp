#pragma once

#include <cstddef>
#include <cstdint>

#include "sim/wire/little_endian.hpp"

/// GigE Vision stream packets (GVSP 1.x headers, 16-bit block ids, image payload), big endian. What Aravis's fake
/// camera sends, written here so that packets can be paced, lost on purpose and sent again. Pure functions, reentrant.
namespace hueline::sim {

/// IP, UDP and GVSP headers: what of the stream packet size register is not data.
constexpr std::uint32_t kGvspOverheadBytes = 20 + 8 + 8;

enum class GvspStatus : std::uint16_t { Success = 0, Resent = 0x0100, Unavailable = 0x800C };

/// An image as its leader announces it.
struct GvspImage {
  std::uint16_t block_id = 0;      ///< 1 .. 65535, then 1 again
  std::uint64_t timestamp = 0;     ///< ticks of the camera's counter
  std::uint32_t pixel_format = 0;  ///< PFNC number
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
  std::size_t payload_bytes = 0;
};

/// Packets of an image: leader 0, data 1 .. n, trailer n + 1.
std::uint32_t gvsp_data_packets(const GvspImage& image, std::uint32_t packet_bytes);

Bytes encode_gvsp_leader(const GvspImage& image, GvspStatus status);
Bytes encode_gvsp_trailer(const GvspImage& image, std::uint32_t packet_id, GvspStatus status);
/// The 8 bytes before a data packet's pixels; alone with status Unavailable, the answer for a packet that is gone.
Bytes encode_gvsp_data_header(std::uint16_t block_id, std::uint32_t packet_id, GvspStatus status);

}  // namespace hueline::sim
