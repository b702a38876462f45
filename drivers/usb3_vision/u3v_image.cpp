#include "drivers/usb3_vision/u3v_image.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint64_t kLeader = 0x4C563355, kTrailer = 0x54563355;  // "U3VL", "U3VT"
constexpr std::size_t kHead = 20, kImageLeader = 52, kShortestTrailer = 28;
constexpr std::uint32_t kMostPixelsInRow = 1U << 20U;

std::uint64_t get(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint64_t>(bytes[at + i]) << (8 * i);
  return value;
}
std::uint32_t get32(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(get(bytes, at, 4));
}
std::uint16_t get16(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(get(bytes, at, 2));
}

bool is_message(std::span<const std::byte> packet, std::uint64_t magic, std::size_t least) {
  return packet.size() >= least && get(packet, 0, 4) == magic && get(packet, 6, 2) >= least &&
         get(packet, 6, 2) <= packet.size();
}

}  // namespace

std::optional<U3vLeader> read_u3v_leader(std::span<const std::byte> packet) {
  if (!is_message(packet, kLeader, kHead)) return std::nullopt;
  U3vLeader out;
  out.payload_type = get16(packet, 18);
  out.image.frame_id = get(packet, 8, 8);
  if (!out.is_image()) return out;
  if (!is_message(packet, kLeader, kImageLeader)) return std::nullopt;
  out.image.time = DeviceTime<CameraCounter>(nanoseconds(static_cast<std::int64_t>(get(packet, 20, 8))));
  out.image.pfnc = get32(packet, 28);
  out.image.width = get32(packet, 32);
  out.image.height = get32(packet, 36);
  out.image.offset_x = get32(packet, 40);
  out.image.offset_y = get32(packet, 44);
  // Bits 16 to 23 of a PFNC code are the number of bits of one pixel.
  if (out.image.width > kMostPixelsInRow || out.image.height > kMostPixelsInRow) return std::nullopt;
  out.image.stride = (out.image.width * (out.image.pfnc >> 16 & 0xFF) + 7) / 8 + get16(packet, 48);
  return out;
}

std::optional<U3vTrailer> read_u3v_trailer(std::span<const std::byte> packet) {
  if (!is_message(packet, kTrailer, kShortestTrailer)) return std::nullopt;
  return U3vTrailer{.frame_id = get(packet, 8, 8), .status = get16(packet, 16), .payload_bytes = get(packet, 20, 8)};
}

}  // namespace hueline::drivers
