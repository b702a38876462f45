#include "drivers/ladybug/ladybug_assembler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hueline::drivers {

void LadybugAssembler::take(std::span<const std::byte> bytes, bool is_short, HostTime received) {
  while (!bytes.empty()) {
    if (place_ != Place::Image) {
      const auto packet = bytes.first(std::min(packet_bytes_, bytes.size()));
      begin_image(packet, received);
      if (place_ != Place::Image) {
        if (place_ == Place::Start || padding_ == 0) place_ = Place::Lost;
        padding_ -= std::min(padding_, packet.size());
        if (place_ == Place::Lost) strange_ += packet.size();
        bytes = bytes.subspan(packet.size());
        continue;
      }
    }
    const std::size_t piece = std::min(size_ - filled_, bytes.size());
    if (image_) std::ranges::copy(bytes.first(piece), image_.data() + filled_);
    filled_ += piece;
    if (filled_ < size_) break;
    if (image_) give({kSystemSensor, PacketKind::Wire, false, 0, received, std::exchange(image_, {}).share()});
    place_ = Place::Padding;
    // The next image can only begin with a packet.
    const std::size_t to_packet = (packet_bytes_ - filled_ % packet_bytes_) % packet_bytes_;
    padding_ = buffer_bytes_ - size_ - std::min(buffer_bytes_ - size_, to_packet);
    bytes = bytes.subspan(std::min(piece + to_packet, bytes.size()));
  }
  if (!is_short) return;
  if (place_ == Place::Image) break_off("the camera ended it before", received);
  tell_strange(received);
  place_ = Place::Start;
}

void LadybugAssembler::begin_image(std::span<const std::byte> packet, HostTime received) {
  const auto size = ladybug_image_size(packet);
  if (!size || *size > buffer_bytes_) return;
  tell_strange(received);
  place_ = Place::Image;
  size_ = *size;
  filled_ = 0;
  image_ = memory_.acquire(size_);
  if (image_) return;
  give_overflow(memory_, received);
}

void LadybugAssembler::interrupt(std::string_view why, HostTime at) {
  if (place_ == Place::Image)
    break_off(why, at);
  else
    give(fault_packet(at, FaultKind::Malformed, 1, fmt::format("{}: bytes are missing", why)));
  tell_strange(at);
  place_ = Place::Lost;
}

void LadybugAssembler::break_off(std::string_view why, HostTime at) {
  give(fault_packet(at, FaultKind::Malformed, filled_,
                    fmt::format("an image of {} bytes was broken off after {}: {}", size_, filled_, why)));
  image_ = {};
}

void LadybugAssembler::tell_strange(HostTime at) {
  const std::uint64_t strange = std::exchange(strange_, 0);
  if (strange > 0)
    give(fault_packet(at, FaultKind::Malformed, strange, fmt::format("{} bytes on USB are no image", strange)));
}

}  // namespace hueline::drivers
