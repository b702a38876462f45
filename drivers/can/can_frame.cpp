#include "drivers/can/can_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {
namespace {

// The kernel's flags in the id (linux/can.h). cannelloni uses the same flags.
constexpr std::uint32_t kExtendedFlag = 0x80000000, kRemoteFlag = 0x40000000, kErrorFlag = 0x20000000;
constexpr std::uint32_t kStandardMask = 0x7FF, kExtendedMask = 0x1FFFFFFF;
constexpr std::uint8_t kFlagFd = 1, kFlagLocal = 2;
constexpr std::size_t kClassicData = 8;

constexpr std::uint8_t kCannelloniVersion = 2, kCannelloniData = 0, kCannelloniFd = 0x80;
constexpr std::size_t kCannelloniHeader = 5;

std::uint32_t big32(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
  return value;
}
void take_id(CanFrame& frame, std::uint32_t id) {
  frame.is_error = (id & kErrorFlag) != 0;
  frame.is_extended = !frame.is_error && (id & kExtendedFlag) != 0;
  frame.is_remote = !frame.is_error && (id & kRemoteFlag) != 0;
  frame.id = id & (frame.is_extended || frame.is_error ? kExtendedMask : kStandardMask);
}

void take_data(CanFrame& frame, std::span<const std::byte> data) {
  frame.length = static_cast<std::uint8_t>(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) frame.data[i] = std::to_integer<std::uint8_t>(data[i]);
}

Error malformed(std::string what) { return {ErrorCode::Malformed, std::move(what)}; }

Status decode_kernel_frame(std::span<const std::byte> bytes, CanPacket& out) {
  if (bytes.size() < kCanHeaderSize)
    return malformed(fmt::format("a CAN packet of {} bytes: its head alone has {}", bytes.size(), kCanHeaderSize));
  CanFrame frame;
  const auto flags = std::to_integer<std::uint8_t>(bytes[4]);
  frame.is_fd = (flags & kFlagFd) != 0;
  frame.is_local = (flags & kFlagLocal) != 0;
  frame.bus = std::to_integer<std::uint8_t>(bytes[5]);
  if (const auto stamp = get_little<std::uint64_t>(bytes, 8))
    frame.adapter_time = DeviceTime<CanAdapterCounter>(nanoseconds(static_cast<std::int64_t>(stamp)));
  const std::size_t size = kCanHeaderSize + (frame.is_fd ? kCanFdFrameSize : kCanFrameSize);
  if (bytes.size() != size) return malformed(fmt::format("a CAN packet of {} bytes, {} expected", bytes.size(), size));
  take_id(frame, get_little<std::uint32_t>(bytes, kCanHeaderSize));
  const auto length = std::to_integer<std::uint8_t>(bytes[kCanHeaderSize + 4]);
  const std::size_t most = frame.is_fd ? kCanDataMost : kClassicData;
  if (length > most) return malformed(fmt::format("a CAN frame of {} data bytes, {} are the most", length, most));
  take_data(frame, bytes.subspan(kCanHeaderSize + 8, length));
  frame.packet_bytes = bytes.size();
  out.frames.push_back(frame);
  return {};
}

Status decode_datagram(std::span<const std::byte> bytes, CanPacket& out) {
  const auto at_byte = [&](std::size_t at) { return std::to_integer<std::uint8_t>(bytes[at]); };
  if (bytes.size() < kCannelloniHeader || at_byte(0) != kCannelloniVersion || at_byte(1) != kCannelloniData)
    return malformed(
        fmt::format("{} bytes that are neither a CAN packet nor a cannelloni datagram of version 2", bytes.size()));
  out.datagram_sequence = at_byte(2);
  out.header_bytes = kCannelloniHeader;
  const std::size_t count = static_cast<std::size_t>(at_byte(3)) << 8 | at_byte(4);
  std::size_t at = kCannelloniHeader;
  for (std::size_t i = 0; i < count; ++i) {
    const auto cut = [&] {
      return malformed(
          fmt::format("a cannelloni datagram of {} bytes ends inside frame {} of {}", bytes.size(), i + 1, count));
    };
    const std::size_t begin = at;
    if (bytes.size() < at + 5) return cut();
    CanFrame frame;
    take_id(frame, big32(bytes, at));
    const std::uint8_t length = at_byte(at + 4);
    at += 5;
    frame.is_fd = (length & kCannelloniFd) != 0;
    if (frame.is_fd && bytes.size() < ++at) return cut();  // the flags of CAN FD
    const std::size_t data = frame.is_remote ? 0 : length & (kCannelloniFd - 1);
    const std::size_t most = frame.is_fd ? kCanDataMost : kClassicData;
    if (data > most) return malformed(fmt::format("a cannelloni frame of {} data bytes, {} are the most", data, most));
    if (bytes.size() < at + data) return cut();
    take_data(frame, bytes.subspan(at, data));
    at += data;
    frame.packet_bytes = at - begin;
    out.frames.push_back(frame);
  }
  if (at != bytes.size())
    return malformed(
        fmt::format("a cannelloni datagram of {} bytes goes on behind its {} frames", bytes.size(), count));
  return {};
}

}  // namespace

std::string name(const CanFrame& frame) {
  if (frame.is_error) return fmt::format("error {:04X}", frame.id);
  return frame.is_extended ? fmt::format("{:08X}", frame.id) : fmt::format("{:03X}", frame.id);
}

std::vector<std::byte> encode_can_packet(const CanFrame& frame) {
  std::vector<std::byte> out(kCanHeaderSize + (frame.is_fd ? kCanFdFrameSize : kCanFrameSize));
  put_little(out, 0, kCanMagic);
  out[4] = static_cast<std::byte>((frame.is_fd ? kFlagFd : 0) | (frame.is_local ? kFlagLocal : 0));
  out[5] = static_cast<std::byte>(frame.bus);
  put_little(out, 8,
             frame.adapter_time ? static_cast<std::uint64_t>(frame.adapter_time->time_since_epoch().count()) : 0);
  put_little(out, kCanHeaderSize,
             frame.id | (frame.is_extended ? kExtendedFlag : 0) | (frame.is_remote ? kRemoteFlag : 0) |
                 (frame.is_error ? kErrorFlag : 0));
  const std::size_t length = std::min<std::size_t>(frame.length, frame.is_fd ? kCanDataMost : kClassicData);
  out[kCanHeaderSize + 4] = static_cast<std::byte>(length);
  for (std::size_t i = 0; i < length; ++i) out[kCanHeaderSize + 8 + i] = static_cast<std::byte>(frame.data[i]);
  return out;
}

Status decode_can_packet(std::span<const std::byte> bytes, CanPacket& out) {
  out = {};
  if (bytes.size() >= 4 && get_little<std::uint32_t>(bytes, 0) == kCanMagic) return decode_kernel_frame(bytes, out);
  return decode_datagram(bytes, out);
}

}  // namespace hueline::drivers
