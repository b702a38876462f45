#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/gige/image_packet.hpp"

/// The two messages around the pixels of a USB3 Vision image: USB3 Vision 1.0, chapter 5 (streaming). Pure functions.
namespace hueline::drivers {

/// What comes before the pixels.
struct U3vLeader {
  std::uint16_t payload_type = 0;
  /// What an image's leader says of it; the status is Complete. Only the frame id is set if the payload is no image.
  ImageHeader image;
  /// Whether the payload begins with an image. Chunk data may follow it.
  bool is_image() const { return payload_type == 0x0001 || has_chunks(); }
  bool has_chunks() const { return payload_type == 0x4001; }
};
/// What comes behind the pixels.
struct U3vTrailer {
  std::uint64_t frame_id = 0;
  std::uint16_t status = 0;         ///< 0: the camera sent the whole payload
  std::uint64_t payload_bytes = 0;  ///< that are valid
};

/// Return the message that `packet` is, or nothing if it is none.
std::optional<U3vLeader> read_u3v_leader(std::span<const std::byte> packet);
std::optional<U3vTrailer> read_u3v_trailer(std::span<const std::byte> packet);

}  // namespace hueline::drivers
