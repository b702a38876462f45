#include "drivers/pps/ptp_packet.hpp"

#include <fmt/format.h>

namespace hueline::drivers {
namespace {

void put(std::byte* at, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) at[i] = static_cast<std::byte>(value >> (8 * i));
}
std::uint64_t get(const std::byte* at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= static_cast<std::uint64_t>(at[i]) << (8 * i);
  return value;
}

}  // namespace

std::array<std::byte, kPtpPacketSize> encode_ptp(const PtpPacket& packet) {
  std::array<std::byte, kPtpPacketSize> bytes;
  put(&bytes[0], kPtpMagic, 4);
  put(&bytes[4], static_cast<std::uint64_t>(packet.half_window.count()), 4);
  put(&bytes[8], packet.sequence, 8);
  put(&bytes[16], static_cast<std::uint64_t>(packet.clock.count()), 8);
  put(&bytes[24], static_cast<std::uint64_t>(count_ns(packet.host)), 8);
  return bytes;
}

bool is_ptp_packet(std::span<const std::byte> bytes) { return bytes.size() >= 4 && get(&bytes[0], 4) == kPtpMagic; }

Result<PtpPacket> decode_ptp(std::span<const std::byte> bytes) {
  if (bytes.size() != kPtpPacketSize || !is_ptp_packet(bytes))
    return Error{ErrorCode::Malformed, fmt::format("packet of {} bytes is no reading of a PTP clock, which has {}",
                                                   bytes.size(), kPtpPacketSize)};
  return PtpPacket{nanoseconds(static_cast<std::int64_t>(get(&bytes[4], 4))), get(&bytes[8], 8),
                   nanoseconds(static_cast<std::int64_t>(get(&bytes[16], 8))),
                   host_time_ns(static_cast<std::int64_t>(get(&bytes[24], 8)))};
}

}  // namespace hueline::drivers
