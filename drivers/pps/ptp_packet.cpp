#include "drivers/pps/ptp_packet.hpp"

#include <fmt/format.h>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {
std::array<std::byte, kPtpPacketSize> encode_ptp(const PtpPacket& packet) {
  std::array<std::byte, kPtpPacketSize> bytes;
  put_little(bytes, 0, kPtpMagic);
  put_little(bytes, 4, static_cast<std::uint32_t>(packet.half_window.count()));
  put_little(bytes, 8, packet.sequence);
  put_little(bytes, 16, static_cast<std::uint64_t>(packet.clock.count()));
  put_little(bytes, 24, static_cast<std::uint64_t>(count_ns(packet.host)));
  return bytes;
}

Result<PtpPacket> decode_ptp(std::span<const std::byte> bytes) {
  if (bytes.size() != kPtpPacketSize || get_little<std::uint32_t>(bytes, 0) != kPtpMagic)
    return Error{ErrorCode::Malformed, fmt::format("packet of {} bytes is no reading of a PTP clock, which has {}",
                                                   bytes.size(), kPtpPacketSize)};
  return PtpPacket{nanoseconds(static_cast<std::int64_t>(get_little<std::uint32_t>(bytes, 4))),
                   get_little<std::uint64_t>(bytes, 8),
                   nanoseconds(static_cast<std::int64_t>(get_little<std::uint64_t>(bytes, 16))),
                   host_time_ns(static_cast<std::int64_t>(get_little<std::uint64_t>(bytes, 24)))};
}

}  // namespace hueline::drivers
