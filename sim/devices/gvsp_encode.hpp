#pragma once

#include <cstddef>
#include <cstdint>

#include "sim/wire/little_endian.hpp"

/// GigE Vision stream packets (GVSP 1.x headers, 16-bit block ids, image payload), big endian. They are those of
/// Aravis's fake camera, written here so that packets can be paced, lost on purpose and sent again. Pure functions,
/// reentrant.
namespace hueline::sim {

/// Size of the IP, UDP and GVSP headers: the part of the stream packet size that is not data.
constexpr std::uint32_t kGvspOverheadBytes = 20 + 8 + 8;

/// Status of a stream packet. Resent: sent again on request. Unavailable: no longer kept by the camera.
enum class GvspStatus : std::uint16_t { Success = 0, Resent = 0x0100, Unavailable = 0x800C };

/// An image as its leader packet announces it.
struct GvspImage {
  std::uint16_t block_id = 0;      ///< 1 .. 65535, then 1 again
  std::uint64_t timestamp = 0;     ///< in ticks of the camera's counter
  std::uint32_t pixel_format = 0;  ///< number of the Pixel Format Naming Convention
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
  std::size_t payload_bytes = 0;
  /// With chunks 0x4001 (GigE Vision 2.x), or 5 as older cameras have it.
  std::uint16_t payload_type = 1;
};

/// Returns the number of data packets n of an image. The leader is packet 0, the data packets are 1 .. n, the trailer
/// is n + 1.
std::uint32_t gvsp_data_packets(const GvspImage& image, std::uint32_t packet_bytes);

/// Encode the packets that announce an image and end it.
Bytes encode_gvsp_leader(const GvspImage& image, GvspStatus status);
Bytes encode_gvsp_trailer(const GvspImage& image, std::uint32_t packet_id, GvspStatus status);
/// Encodes the 8 bytes before the pixels of a data packet. With status Unavailable and without pixels they are the
/// answer for a packet that the camera no longer has.
Bytes encode_gvsp_data_header(std::uint16_t block_id, std::uint32_t packet_id, GvspStatus status);

}  // namespace hueline::sim
