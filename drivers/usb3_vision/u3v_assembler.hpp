#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <utility>

#include "core/buffer.hpp"
#include "core/packet.hpp"
#include "core/time.hpp"
#include "drivers/gige/image_packet.hpp"
#include "drivers/guest/packet_memory.hpp"
#include "drivers/transport/usb_packet_reader.hpp"
#include "drivers/usb3_vision/u3v_image.hpp"

namespace hueline::drivers {

/// Puts together the images of a USB3 Vision camera from what its stream's endpoint gives: a leader in a packet of its
/// own, the payload, and a trailer in a packet of its own. The payload ends when it is whole, or earlier with a short
/// packet; it may be filled up to the camera's alignment. How the transfers of the computer cut the stream does not
/// matter.
///
/// A packet is one image with the header of image_packet.hpp; `received` is when the transfer with its trailer had
/// come. An image that is not whole is delivered with its status.
/// Fault packets: Lost, an image that is not whole; Malformed, with the number of bytes that belong to no image, or 1
/// for bytes that are missing between images, or for a payload that is no image; Overflow, an image for which there was
/// no memory.
/// Thread safety: none; one thread calls all functions.
class U3vAssembler final : public UsbPacketReader {
 public:
  struct Shape {
    std::size_t packet_bytes = 1024;  ///< of the endpoint
    std::size_t payload_bytes = 0;    ///< of one image, without what fills it up
    std::size_t padding_bytes = 0;    ///< that may fill it up
  };
  /// Reads the chunks behind the pixels of a whole image's payload into its header.
  using ReadChunks = std::function<void(std::span<const std::byte> payload, ImageHeader& header)>;
  /// The memory has to outlive this object. Without `read_chunks` they are left alone.
  U3vAssembler(const Shape& shape, PacketMemory& memory, ReadChunks read_chunks = {})
      : shape_(shape), memory_(memory), read_chunks_(std::move(read_chunks)) {}

  void take(std::span<const std::byte> bytes, bool is_short, HostTime received) override;
  void interrupt(std::string_view why, HostTime at) override;

 private:
  enum class Place : std::uint8_t {
    Leader,   ///< a leader has to come
    Payload,  ///< inside a payload
    Trailer,  ///< behind a payload
  };
  bool take_message(std::span<const std::byte> packet, HostTime received);
  void begin_image(const U3vLeader& leader, HostTime received);
  void end_image(const U3vTrailer& trailer, HostTime received);
  void give_up(ImageStatus status, std::string_view why, HostTime at);
  void deliver(HostTime received);
  void tell_strange(HostTime at);

  const Shape shape_;
  PacketMemory& memory_;
  const ReadChunks read_chunks_;
  Place place_ = Place::Leader;
  ImageHeader header_;  // of the image that is under way
  bool has_chunks_ = false;
  MutableBuffer image_;  // empty if there was no memory
  std::size_t filled_ = 0;
  std::size_t padding_ = 0;    // bytes that may still follow the payload
  std::uint64_t strange_ = 0;  // bytes since the last image that belong to none
};

}  // namespace hueline::drivers
