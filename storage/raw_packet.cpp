#include "storage/raw_packet.hpp"

#include <utility>

#include "storage/packed_rows.hpp"

namespace hueline::storage {
namespace {

// Field number and wire type, which stand before each value.
constexpr std::uint8_t kSequence = 1 << 3 | 1, kReceived = 2 << 3 | 1;                // 64 bits
constexpr std::uint8_t kKind = 3 << 3 | 0, kShed = 4 << 3 | 0, kSensor = 5 << 3 | 0;  // varint
constexpr std::uint8_t kPayload = 6 << 3 | 2, kPacked = 7 << 3 | 2;                   // length and bytes

void append_varint(Bytes& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) append(out, static_cast<std::uint8_t>(value | 0x80));
  append(out, static_cast<std::uint8_t>(value));
}

/// Reads a varint. Returns false at the end of the bytes, or after ten of them.
bool take_varint(ByteReader& in, std::uint64_t& value) {
  value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const auto byte = in.take<std::uint8_t>();
    if (!in.ok()) return false;
    value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
    if (!(byte & 0x80)) return true;
  }
  return false;
}

}  // namespace

void append_raw_packet_head(Bytes& out, const Packet& packet, std::size_t payload_bytes, bool is_packed) {
  append(out, kSequence);
  append(out, packet.sequence);
  append(out, kReceived);
  append(out, count_ns(packet.received));
  append(out, kKind);
  append(out, static_cast<std::uint8_t>(packet.kind));
  append(out, kShed);
  append(out, static_cast<std::uint8_t>(packet.shed));
  append(out, kSensor);
  append_varint(out, packet.sensor);
  append(out, is_packed ? kPacked : kPayload);
  append_varint(out, payload_bytes);
}

Result<Packet> decode_raw_packet(const Buffer& message) {
  Packet packet;
  ByteReader in(message.bytes());
  bool sound = true;
  while (sound && in.remaining() > 0) {
    std::uint64_t tag = 0, value = 0;
    if (!take_varint(in, tag)) break;
    switch (tag & 7) {
      case 0:
        sound = take_varint(in, value);
        break;
      case 1:
        value = in.take<std::uint64_t>();
        break;
      case 2:
        sound = take_varint(in, value);
        if (tag == kPayload) packet.bytes = message.part(in.position(), static_cast<std::size_t>(value));
        if (const ByteView bytes = in.take_bytes(value); tag == kPacked) {
          auto unpacked = unpack_rows(bytes);
          if (!unpacked.ok()) return unpacked.error();
          packet.bytes = std::move(unpacked->payload);
          packet.rows = unpacked->rows;
        }
        break;
      case 5:
        in.take<std::uint32_t>();
        break;
      default:
        sound = false;
    }
    switch (tag) {
      case kSequence:
        packet.sequence = value;
        break;
      case kReceived:
        packet.received = host_time_ns(static_cast<std::int64_t>(value));
        break;
      case kKind:
        sound = sound && value <= static_cast<std::uint64_t>(PacketKind::Ledger);
        packet.kind = static_cast<PacketKind>(sound ? value : 0);
        break;
      case kShed:
        packet.shed = value != 0;
        break;
      case kSensor:
        sound = sound && value <= 0xFFFF;
        packet.sensor = static_cast<SensorId>(value);
        break;
      default:
        break;
    }
  }
  if (!sound || !in.ok()) return Error{ErrorCode::Malformed, "a message is no hueline.RawPacket"};
  return packet;
}

}  // namespace hueline::storage
