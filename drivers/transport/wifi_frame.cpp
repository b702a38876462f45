#include "drivers/transport/wifi_frame.hpp"

#include <cstring>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {
namespace {

unsigned byte_of(std::span<const std::byte> bytes, std::size_t at) { return static_cast<unsigned>(bytes[at]); }

}  // namespace

WifiPayload wifi_payload(std::span<const std::byte> frame, bool is_padded) {
  constexpr std::size_t kThreeAddresses = 24, kAddress = 6;
  if (frame.size() < kThreeAddresses) return {};
  const unsigned control = byte_of(frame, 0), flags = byte_of(frame, 1);
  const bool is_data = (control & 0x0FU) == 0x08;  // version 0, type 2
  const bool is_without_data = (control & 0x40U) != 0, has_quality = (control & 0x80U) != 0;
  const bool to_network = (flags & 0x01U) != 0, from_network = (flags & 0x02U) != 0;
  const bool is_fragment = (flags & 0x04U) != 0 || (byte_of(frame, 22) & 0x0FU) != 0;
  const bool is_encrypted = (flags & 0x40U) != 0;
  if (!is_data || is_without_data || is_fragment || is_encrypted) return {};
  WifiPayload out;
  std::size_t header = kThreeAddresses + (to_network && from_network ? kAddress : 0);
  const std::size_t sender_at = !from_network ? 10 : !to_network ? 16 : 24;
  if (has_quality) {
    if (frame.size() < header + 2 || (byte_of(frame, header) & 0x80U) != 0) return {};  // A-MSDU
    header += 2;
    if ((flags & 0x80U) != 0) header += 4;  // HT control
  }
  if (is_padded) header = (header + 3) / 4 * 4;
  if (frame.size() < header) return {};
  std::memcpy(out.sender.data(), frame.data() + sender_at, kAddress);
  out.body = frame.subspan(header);
  return out;
}

RadiotapHeader radiotap_header(std::span<const std::byte> frame) {
  constexpr std::size_t kFixed = 8;
  if (frame.size() < kFixed || byte_of(frame, 0) != 0) return {};
  const std::size_t length = get_little<std::uint16_t>(frame, 2);
  if (length < kFixed || length > frame.size()) return {};
  RadiotapHeader out{length, false};
  // Words that say which fields follow; the highest bit says that another word does.
  const std::uint32_t present = get_little<std::uint32_t>(frame, 4);
  std::size_t at = kFixed;
  for (std::uint32_t word = present; (word & 0x80000000U) != 0; at += 4) {
    if (at + 4 > length) return {};
    word = get_little<std::uint32_t>(frame, at);
  }
  constexpr std::uint32_t kTime = 1, kFlags = 2;
  if ((present & kTime) != 0) at = (at + 7) / 8 * 8 + 8;
  out.is_padded = (present & kFlags) != 0 && at < length && (byte_of(frame, at) & 0x20U) != 0;
  return out;
}

}  // namespace hueline::drivers
