#include "drivers/usb3_vision/u3v_image.hpp"

#include "drivers/little_endian.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint64_t kLeader = 0x4C563355, kTrailer = 0x54563355;  // "U3VL", "U3VT"
constexpr std::size_t kMessageHead = 20, kImageLeader = 52, kShortestTrailer = 28;
constexpr std::uint32_t kMostPixelsInRow = 1U << 20U;

bool is_message(std::span<const std::byte> packet, std::uint64_t magic, std::size_t least) {
  return packet.size() >= least && get_little<std::uint32_t>(packet, 0) == magic &&
         get_little<std::uint16_t>(packet, 6) >= least && get_little<std::uint16_t>(packet, 6) <= packet.size();
}

}  // namespace

std::optional<U3vLeader> read_u3v_leader(std::span<const std::byte> packet) {
  if (!is_message(packet, kLeader, kMessageHead)) return std::nullopt;
  U3vLeader out;
  out.payload_type = get_little<std::uint16_t>(packet, 18);
  out.image.frame_id = get_little<std::uint64_t>(packet, 8);
  if (!out.is_image()) return out;
  if (!is_message(packet, kLeader, kImageLeader)) return std::nullopt;
  out.image.time =
      DeviceTime<CameraCounter>(nanoseconds(static_cast<std::int64_t>(get_little<std::uint64_t>(packet, 20))));
  out.image.pfnc = get_little<std::uint32_t>(packet, 28);
  out.image.width = get_little<std::uint32_t>(packet, 32);
  out.image.height = get_little<std::uint32_t>(packet, 36);
  out.image.offset_x = get_little<std::uint32_t>(packet, 40);
  out.image.offset_y = get_little<std::uint32_t>(packet, 44);
  // Bits 16 to 23 of a PFNC code are the number of bits of one pixel.
  if (out.image.width > kMostPixelsInRow || out.image.height > kMostPixelsInRow) return std::nullopt;
  out.image.stride = (out.image.width * (out.image.pfnc >> 16 & 0xFF) + 7) / 8 + get_little<std::uint16_t>(packet, 48);
  return out;
}

std::optional<U3vTrailer> read_u3v_trailer(std::span<const std::byte> packet) {
  if (!is_message(packet, kTrailer, kShortestTrailer)) return std::nullopt;
  return U3vTrailer{.frame_id = get_little<std::uint64_t>(packet, 8),
                    .status = get_little<std::uint16_t>(packet, 16),
                    .payload_bytes = get_little<std::uint64_t>(packet, 20)};
}

}  // namespace hueline::drivers
