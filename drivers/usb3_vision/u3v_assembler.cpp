#include "drivers/usb3_vision/u3v_assembler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hueline::drivers {

void U3vAssembler::take(std::span<const std::byte> bytes, bool is_short, HostTime received) {
  // A transfer that is a message and nothing else tells where the camera is, also if pixels were expected.
  const bool is_message =
      place_ == Place::Payload && is_short && bytes.size() < shape_.packet_bytes && take_message(bytes, received);
  std::size_t in_packet = 0;  // place in the packet at which `bytes` begin
  if (is_message) bytes = {};
  while (!bytes.empty()) {
    std::size_t piece = std::min(shape_.packet_bytes, bytes.size());
    if (place_ == Place::Payload) {
      piece = std::min(shape_.payload_bytes - filled_, bytes.size());
      if (image_) std::ranges::copy(bytes.first(piece), image_.data() + kImageHeaderSize + filled_);
      filled_ += piece;
      if (filled_ == shape_.payload_bytes) {
        place_ = Place::Trailer;
        padding_ = shape_.padding_bytes;
        // A trailer can only begin with a packet.
        in_packet = (in_packet + piece) % shape_.packet_bytes;
        const std::size_t to_packet = in_packet == 0 ? 0 : shape_.packet_bytes - in_packet;
        const std::size_t filling = std::min({to_packet, bytes.size() - piece, padding_});
        padding_ -= filling;
        piece += filling;
        in_packet = 0;
      }
    } else if (!take_message(bytes.first(piece), received)) {
      if (place_ == Place::Trailer && padding_ >= piece) {
        padding_ -= piece;
      } else {
        if (place_ == Place::Trailer) give_up(ImageStatus::Broken, "it is larger than the camera announced", received);
        strange_ += piece;
      }
    }
    bytes = bytes.subspan(piece);
  }
  // A short packet ends a payload.
  if (is_short && !is_message && place_ == Place::Payload && filled_ > 0) {
    place_ = Place::Trailer;
    padding_ = 0;
  }
}

/// Returns false if the packet is neither a leader nor a trailer that can come here.
bool U3vAssembler::take_message(std::span<const std::byte> packet, HostTime received) {
  if (const auto leader = read_u3v_leader(packet)) {
    if (place_ != Place::Leader)
      give_up(ImageStatus::MissingPackets, "the next image began before its end had come", received);
    begin_image(*leader, received);
    return true;
  }
  if (place_ == Place::Leader) return false;
  const auto trailer = read_u3v_trailer(packet);
  if (!trailer) return false;
  end_image(*trailer, received);
  return true;
}

void U3vAssembler::begin_image(const U3vLeader& leader, HostTime received) {
  tell_strange(received);
  if (!leader.is_image()) {
    give(fault_packet(received, FaultKind::Malformed, 1,
                      fmt::format("the camera sends a payload of type 0x{:04x}, which is no image; turn its "
                                  "chunk mode off (features: ChunkModeActive=false)",
                                  leader.payload_type)));
    place_ = Place::Leader;
    return;
  }
  place_ = shape_.payload_bytes > 0 ? Place::Payload : Place::Trailer;
  header_ = leader.image;
  has_chunks_ = leader.has_chunks();
  filled_ = 0;
  image_ = memory_.acquire(kImageHeaderSize + shape_.payload_bytes);
  if (image_) return;
  give_overflow(memory_, received);
}

void U3vAssembler::end_image(const U3vTrailer& trailer, HostTime received) {
  const std::uint64_t whole = header_.pixel_bytes();
  if (trailer.frame_id != header_.frame_id)
    return give_up(ImageStatus::Broken, fmt::format("its end is that of image {}", trailer.frame_id), received);
  if (whole > shape_.payload_bytes)
    return give_up(ImageStatus::Broken, "it is larger than the size that the camera was set to", received);
  if (filled_ < whole || trailer.payload_bytes < whole)
    return give_up(ImageStatus::MissingPackets,
                   fmt::format("{} of {} bytes came", std::min<std::uint64_t>(filled_, trailer.payload_bytes), whole),
                   received);
  if (trailer.status != 0)
    return give_up(ImageStatus::Broken, fmt::format("the camera gives it the status 0x{:04x}", trailer.status),
                   received);
  const std::size_t valid = std::min<std::uint64_t>(filled_, trailer.payload_bytes);
  if (has_chunks_ && read_chunks_ && image_) read_chunks_(std::span(image_.data() + kImageHeaderSize, valid), header_);
  deliver(received);
}

void U3vAssembler::give_up(ImageStatus status, std::string_view why, HostTime at) {
  header_.status = status;
  give(fault_packet(at, FaultKind::Lost, 1, fmt::format("image {} is not whole: {}", header_.frame_id, why)));
  deliver(at);
}

void U3vAssembler::deliver(HostTime received) {
  place_ = Place::Leader;
  MutableBuffer image = std::exchange(image_, {});
  if (!image) return;
  encode_image_header(header_, std::span<std::byte, kImageHeaderSize>(image.data(), kImageHeaderSize));
  image.resize(kImageHeaderSize + std::min<std::uint64_t>(header_.pixel_bytes(), shape_.payload_bytes));
  give({kSystemSensor, PacketKind::Wire, false, 0, received, std::move(image).share()});
}

void U3vAssembler::interrupt(std::string_view why, HostTime at) {
  if (place_ != Place::Leader)
    give_up(ImageStatus::MissingPackets, why, at);
  else
    give(fault_packet(at, FaultKind::Malformed, 1, fmt::format("{}: bytes are missing", why)));
  tell_strange(at);
}

void U3vAssembler::tell_strange(HostTime at) {
  const std::uint64_t strange = std::exchange(strange_, 0);
  if (strange > 0)
    give(fault_packet(at, FaultKind::Malformed, strange,
                      fmt::format("{} bytes on USB belong to no image: no leader came before them", strange)));
}

}  // namespace hueline::drivers
