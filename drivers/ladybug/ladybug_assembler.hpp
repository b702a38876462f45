#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/buffer.hpp"
#include "core/packet.hpp"
#include "core/time.hpp"
#include "drivers/guest/packet_memory.hpp"
#include "drivers/ladybug/ladybug_image.hpp"
#include "drivers/transport/usb_packet_reader.hpp"

namespace hueline::drivers {

/// Puts together the images of a Ladybug (ladybug_image.hpp) from what its bulk endpoint gives. An image begins with a
/// packet of USB. Behind it the camera may send the rest of its buffer, which is no part of the image and is left out.
/// The next image begins where a short packet has ended the last one, or with the next packet that begins as an image
/// does.
///
/// A packet is one image, with its bytes as they came; `received` is when the transfer with its last byte had come.
/// Fault packets: Malformed, with the number of bytes that are no image, or of an image that was broken off, or 1 for
/// bytes that are missing between images; Overflow, an image for which there was no memory.
/// Thread safety: none; one thread calls all functions.
class LadybugAssembler final : public UsbPacketReader {
 public:
  /// `packet_bytes` is the packet size of the endpoint, `buffer_bytes` the size of the camera's buffer, in which each
  /// image lies. The memory has to outlive this object.
  LadybugAssembler(std::size_t packet_bytes, std::size_t buffer_bytes, PacketMemory& memory)
      : packet_bytes_(packet_bytes), buffer_bytes_(buffer_bytes), memory_(memory) {}

  void take(std::span<const std::byte> bytes, bool is_short, HostTime received) override;
  void interrupt(std::string_view why, HostTime at) override;

 private:
  enum class Place : std::uint8_t {
    Start,    ///< an image has to begin here
    Image,    ///< inside an image
    Padding,  ///< behind an image
    Lost,     ///< the beginning of an image is looked for
  };
  void begin_image(std::span<const std::byte> packet, HostTime received);
  void break_off(std::string_view why, HostTime at);
  void tell_strange(HostTime at);

  const std::size_t packet_bytes_, buffer_bytes_;
  PacketMemory& memory_;
  Place place_ = Place::Lost;  // a camera that is streaming already may be inside an image
  MutableBuffer image_;        // empty if there was no memory
  std::size_t size_ = 0, filled_ = 0;
  std::size_t padding_ = 0;    // bytes that may still follow the image
  std::uint64_t strange_ = 0;  // bytes since the last packet that are no image
};

}  // namespace hueline::drivers
