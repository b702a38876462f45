#include "sim/devices/gvsp_encode.hpp"

#include "sim/devices/big_endian.hpp"

namespace hueline::sim {
namespace {

enum class Format : std::uint8_t { Leader = 1, Trailer = 2, Data = 3 };

Bytes header(std::uint16_t block_id, std::uint32_t packet_id, GvspStatus status, Format format) {
  Bytes out;
  out.reserve(64);
  put_be16(out, static_cast<std::uint32_t>(status));
  put_be16(out, block_id);
  put_be32(out, static_cast<std::uint32_t>(format) << 24U | (packet_id & 0xffffffU));
  return out;
}

}  // namespace

std::uint32_t gvsp_data_packets(const GvspImage& image, std::uint32_t packet_bytes) {
  const std::size_t data = packet_bytes - kGvspOverheadBytes;
  return static_cast<std::uint32_t>((image.payload_bytes + data - 1) / data);
}

Bytes encode_gvsp_leader(const GvspImage& image, GvspStatus status) {
  Bytes out = header(image.block_id, 0, status, Format::Leader);
  put_be16(out, 0);
  put_be16(out, image.payload_type);
  put_be32(out, static_cast<std::uint32_t>(image.timestamp >> 32U));
  put_be32(out, static_cast<std::uint32_t>(image.timestamp & 0xffffffffU));
  put_be32(out, image.pixel_format);
  put_be32(out, image.width);
  put_be32(out, image.height);
  put_be32(out, image.offset_x);
  put_be32(out, image.offset_y);
  put_be16(out, 0);  // no padding at the ends of lines and image
  put_be16(out, 0);
  return out;
}

Bytes encode_gvsp_trailer(const GvspImage& image, std::uint32_t packet_id, GvspStatus status) {
  Bytes out = header(image.block_id, packet_id, status, Format::Trailer);
  put_be16(out, 0);
  put_be16(out, image.payload_type);
  put_be32(out, image.height);
  return out;
}

Bytes encode_gvsp_data_header(std::uint16_t block_id, std::uint32_t packet_id, GvspStatus status) {
  return header(block_id, packet_id, status, Format::Data);
}

}  // namespace hueline::sim
