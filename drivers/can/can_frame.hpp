#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

/// Frames of a CAN bus, and the two forms in which they come as packets: as the kernel gives them (CanSource,
/// CanLogSource), and several in a datagram of a CAN-to-Ethernet gateway (cannelloni, version 2, by UdpSource).
/// docs/formats.md, "CAN".
namespace hueline::drivers {

constexpr std::uint32_t kCanMagic = 0x314E4143;  ///< "CAN1"
constexpr std::size_t kCanHeaderSize = 16, kCanFrameSize = 16, kCanFdFrameSize = 72;
constexpr std::size_t kCanDataMost = 64;

/// One frame of a bus, or what its controller says of the bus.
struct CanFrame {
  std::uint32_t id = 0;  ///< 11 or 29 bits; of an error frame: its classes (linux/can/error.h)
  bool is_extended = false;
  bool is_remote = false;  ///< asks for data, has none
  bool is_error = false;   ///< made by the controller, was never on the bus
  bool is_fd = false;
  bool is_local = false;  ///< sent by a program of this computer
  std::uint8_t bus = 0;   ///< channel of a log with several; else 0
  std::uint8_t length = 0;
  std::array<std::uint8_t, kCanDataMost> data{};
  /// The adapter's own stamp of the end of the frame, if it has one.
  std::optional<DeviceTime<CanAdapterCounter>> adapter_time;
  std::size_t packet_bytes = 0;  ///< of the packet that are this frame

  std::span<const std::uint8_t> bytes() const { return {data.data(), length}; }
};

/// "0B2", "18FEBF0B" (29 bits), "error 0044".
std::string name(const CanFrame& frame);

/// The packet of one frame; `packet_bytes` is not used.
std::vector<std::byte> encode_can_packet(const CanFrame& frame);

/// The frames of a packet, in their order: of the one frame that encode_can_packet made, or of a cannelloni datagram.
struct CanPacket {
  std::vector<CanFrame> frames;
  std::optional<std::uint8_t> datagram_sequence;  ///< cannelloni's count of its datagrams; wraps
  std::size_t header_bytes = 0;                   ///< that belong to no frame
};
/// Malformed: neither form, or cut short; `out` has the frames that stood whole before it.
Status decode_can_packet(std::span<const std::byte> bytes, CanPacket& out);

}  // namespace hueline::drivers
