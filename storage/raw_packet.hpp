#pragma once

#include "core/packet.hpp"
#include "storage/byte_order.hpp"

/// The protobuf form of a packet (proto/hueline/RawPacket.proto), by hand: the payload stays where it is.
namespace hueline::storage {

/// All of the message up to the payload's bytes; the payload must follow.
void append_raw_packet_head(Bytes& out, const Packet& packet);

/// From a whole message; `bytes` is a part of `message`. Fields may stand in any order; unknown ones are passed over.
/// Malformed if it is no such message.
Result<Packet> decode_raw_packet(const Buffer& message);

}  // namespace hueline::storage
