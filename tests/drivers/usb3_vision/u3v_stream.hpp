#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/fault.hpp"
#include "drivers/gige/image_packet.hpp"
#include "drivers/usb3_vision/u3v_assembler.hpp"
#include "sim/devices/u3v_encode.hpp"

/// The stream of a USB3 Vision camera for tests, as the simulator's camera encodes it.
namespace hueline::test {

using Bytes = std::vector<std::byte>;

constexpr std::uint32_t kBayerRG8 = 0x01080009;

inline sim::U3vImage u3v_image(std::uint64_t number, std::uint32_t width, std::uint32_t height) {
  sim::U3vImage out;
  out.block_id = number;
  out.timestamp_ns = (number << 33) + 5;
  out.pixel_format = kBayerRG8;
  out.width = width;
  out.height = height;
  out.offset_x = 16;
  out.offset_y = 8;
  return out;
}
inline Bytes u3v_pixels(std::uint64_t number, std::size_t size) {
  Bytes out(size);
  for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<std::byte>(number * 31 + i * 7 + (i >> 8));
  return out;
}

/// A pipe of USB: what the camera sends, in packets, is cut into transfers as the host asks for them.
class Pipe {
 public:
  Pipe(drivers::U3vAssembler& assembler, std::size_t packet_bytes, std::vector<std::size_t> transfers)
      : assembler_(assembler), packet_bytes_(packet_bytes), transfers_(std::move(transfers)) {}

  /// Sends a message or a payload. One whose size is no multiple of the packet's ends with a short packet.
  void send(const Bytes& bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += packet_bytes_) {
      const std::size_t size = std::min(packet_bytes_, bytes.size() - at);
      under_way_.insert(under_way_.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                        bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
      if (size < packet_bytes_ || under_way_.size() == transfers_[next_]) end_transfer();
    }
  }
  /// Sends an empty packet.
  void send_nothing() { end_transfer(); }

 private:
  void end_transfer() {
    const bool is_short = under_way_.size() < transfers_[next_];
    next_ = (next_ + 1) % transfers_.size();
    assembler_.take(under_way_, is_short, host_time_ns(++transfers_taken_));
    under_way_.clear();
  }

  drivers::U3vAssembler& assembler_;
  const std::size_t packet_bytes_;
  const std::vector<std::size_t> transfers_;
  std::size_t next_ = 0;
  std::int64_t transfers_taken_ = 0;
  Bytes under_way_;
};

/// What an assembler has made.
struct U3vTold {
  struct Image {
    drivers::ImageHeader header;
    Bytes pixels;
  };
  std::vector<Image> images;
  std::vector<Fault> faults;
};
inline U3vTold pop_all(drivers::U3vAssembler& assembler) {
  U3vTold out;
  while (const auto packet = assembler.pop()) {
    const auto bytes = packet->bytes.bytes();
    if (packet->kind == PacketKind::Fault) {
      out.faults.push_back(*decode_fault(packet->sensor, packet->received, bytes));
      continue;
    }
    const auto pixels = bytes.subspan(drivers::kImageHeaderSize);
    out.images.push_back({drivers::decode_image_header(bytes).value(), Bytes(pixels.begin(), pixels.end())});
  }
  return out;
}

}  // namespace hueline::test
