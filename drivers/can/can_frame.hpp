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

/// Frames of a CAN bus, and the two kinds of packets that carry them (docs/formats.md, "CAN").
///
/// A packet of CanSource and CanLogSource holds one frame, little endian:
///
///   offset   size  field
///        0      4  magic 0x314E4143, the characters "CAN1"
///        4      1  bit 0: CAN FD; bit 1: sent by a program of this computer
///        5      1  channel in a log that has several, else 0
///        6      2  0
///        8      8  stamp of the adapter, signed, ns of its own counter; 0 if it has none
///       16      4  id, with the flags 0x80000000 (29 bits), 0x40000000 (remote), 0x20000000 (error frame)
///       20      1  number of data bytes
///       21      3  not read
///       24  8, 64  data; 64 bytes for CAN FD
///
/// A packet of a CAN-to-Ethernet gateway (cannelloni, version 2, by UdpSource) holds several frames, big endian:
///
///   offset   size  field
///        0      1  version, 2
///        1      1  0 (data)
///        2      1  counter of datagrams; wraps
///        3      2  number of frames
///   each frame
///        0      4  id, with the flags above
///        4      1  number of data bytes; + 0x80 for CAN FD
///        5   0, 1  flags of CAN FD; absent in other frames
///   5 or 6      n  data; none in a remote frame
namespace hueline::drivers {

constexpr std::uint32_t kCanMagic = 0x314E4143;  ///< the characters "CAN1"
constexpr std::size_t kCanHeaderSize = 16, kCanFrameSize = 16, kCanFdFrameSize = 72;
constexpr std::size_t kCanDataMost = 64;

/// One frame of a bus, or a report of its controller about the bus.
struct CanFrame {
  std::uint32_t id = 0;  ///< 11 or 29 bits; in an error frame the classes of the error (linux/can/error.h)
  bool is_extended = false;
  bool is_remote = false;  ///< requests data and has none
  bool is_error = false;   ///< made by the controller; was never on the bus
  bool is_fd = false;
  bool is_local = false;  ///< sent by a program of this computer
  std::uint8_t bus = 0;   ///< channel in a log that has several, else 0
  std::uint8_t length = 0;
  std::array<std::uint8_t, kCanDataMost> data{};
  /// The adapter's own time stamp of the end of the frame, if it has one.
  std::optional<DeviceTime<CanAdapterCounter>> adapter_time;
  std::size_t packet_bytes = 0;  ///< size of this frame in its packet

  std::span<const std::uint8_t> bytes() const { return {data.data(), length}; }
};

/// Returns the name of a frame for messages: "0B2", "18FEBF0B" (29 bits), "error 0044".
std::string name(const CanFrame& frame);

/// Makes the packet of one frame. `packet_bytes` is not used.
std::vector<std::byte> encode_can_packet(const CanFrame& frame);

/// The frames of a packet, in their order.
struct CanPacket {
  std::vector<CanFrame> frames;
  std::optional<std::uint8_t> datagram_sequence;  ///< the counter of a cannelloni datagram; wraps
  std::size_t header_bytes = 0;                   ///< bytes that belong to no frame
};
/// Decodes a packet of either kind. Error: Malformed, if it is neither kind or cut short; `out` then has the whole
/// frames before the error.
Status decode_can_packet(std::span<const std::byte> bytes, CanPacket& out);

}  // namespace hueline::drivers
