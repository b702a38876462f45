#pragma once

#include "core/packet.hpp"
#include "storage/byte_order.hpp"

/// Encodes and decodes the protobuf form of a packet (proto/hueline/RawPacket.proto). This is done by hand so that the
/// payload is not copied.
namespace hueline::storage {

/// Appends the whole message up to the bytes of the payload, which must follow: `payload_bytes` of them, those of the
/// packet or its image packed (storage/packed_rows.hpp).
void append_raw_packet_head(Bytes& out, const Packet& packet, std::size_t payload_bytes, bool is_packed = false);

/// Decodes a whole message. `bytes` of the result is a part of `message`, or what was packed in it. Fields may stand in
/// any order, and unknown fields are skipped. Error: Malformed if this is no such message.
Result<Packet> decode_raw_packet(const Buffer& message);

}  // namespace hueline::storage
