#pragma once

#include <cstdint>
#include <string>

#include "sim/devices/usb_port.hpp"

/// Messages of USB3 Vision 1.0 as a camera sends them, little endian. They are written here, so that a library that a
/// client uses is not tested against itself. Pure functions, reentrant.
namespace hueline::sim {

/// Endpoints of the emulated camera. The two directions of the control channel share a number.
constexpr std::uint8_t kU3vControlEndpoint = 1, kU3vStreamEndpoint = 2;

/// Status codes of GenCP 1.3.
enum class GencpStatus : std::uint16_t {
  Success = 0,
  NotImplemented = 0x8001,
  InvalidParameter = 0x8002,
  InvalidAddress = 0x8003,
  WriteProtected = 0x8004,
  InvalidHeader = 0x800E,
};

/// Types of a payload: an image, and one with chunks behind it.
constexpr std::uint16_t kU3vImagePayload = 0x0001, kU3vImageWithChunks = 0x4001;

/// An image as its leader announces it.
struct U3vImage {
  std::uint64_t block_id = 0;      ///< from 0 in each acquisition
  std::uint64_t timestamp_ns = 0;  ///< the camera's counter
  std::uint32_t pixel_format = 0;  ///< number of the Pixel Format Naming Convention
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
  std::uint16_t payload_type = kU3vImagePayload;
};

/// Returns the descriptors of a camera with a control interface and one stream. `guid` has 12 hexadecimal digits, the
/// first four of which are the maker's.
UsbDescriptors u3v_descriptors(const std::string& maker, const std::string& model, const std::string& version,
                               const std::string& serial, const std::string& guid);

constexpr std::uint32_t kU3vLeaderBytes = 52, kU3vTrailerBytes = 32;
Bytes encode_u3v_leader(const U3vImage& image);
/// `valid_bytes` is the number of payload bytes that the camera has sent.
Bytes encode_u3v_trailer(const U3vImage& image, std::uint64_t valid_bytes);

/// Encodes an acknowledge. `command` is that of the command, whose number plus one is the acknowledge's.
Bytes encode_gencp_acknowledge(std::uint16_t command, GencpStatus status, std::uint16_t request_id, const Bytes& data);
/// Encodes the message that the acknowledge comes later, within `within_ms`.
Bytes encode_gencp_pending(std::uint16_t request_id, std::uint16_t within_ms);

}  // namespace hueline::sim
