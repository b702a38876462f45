#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hueline::drivers {

/// What a frame of a wireless network (IEEE 802.11) carries.
struct WifiPayload {
  /// From the header of LLC on; empty if the frame is no data, encrypted, or several frames in one (A-MSDU).
  std::span<const std::byte> body;
  std::array<std::uint8_t, 6> sender{};  ///< the card that sent the data first; zeros if the frame is no data
};

/// Reads a frame that begins with the header of 802.11, as an interface in monitor mode without encryption captures it.
/// `is_padded`: the header was extended to a multiple of four bytes (radiotap's flag 0x20).
/// Source: IEEE 802.11-2016, 9.2 and 9.3.2.
WifiPayload wifi_payload(std::span<const std::byte> frame, bool is_padded = false);

/// The header that radiotap sets before a frame of 802.11. Source: radiotap.org.
struct RadiotapHeader {
  std::size_t length = 0;  ///< bytes; 0: it is broken
  bool is_padded = false;  ///< the header behind it was extended to a multiple of four bytes
};
RadiotapHeader radiotap_header(std::span<const std::byte> frame);

}  // namespace hueline::drivers
