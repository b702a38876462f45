#include "drivers/can/can_decoder.hpp"

#include <fmt/format.h>

#include <utility>

#include "drivers/can/can_errors.hpp"
#include "drivers/can/can_signal.hpp"

namespace hueline::drivers {

void CanDecoder::tell(FaultKind kind, HostTime time, std::uint64_t count, std::vector<Measurement>& out,
                      std::string detail) const {
  out.push_back(Fault{sensor_, kind, time, count, std::move(detail)});
}

void CanDecoder::reset() {
  datagram_.reset();
  forget();
}

void CanDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  sensor_ = packet.sensor;
  const HostTime received = packet.received;
  if (take_other(packet, out)) {
    counts_.decoded_bytes += packet.bytes.size();
    return;
  }
  prepare(received, out);
  CanPacket parsed;
  const Status whole = decode_can_packet(packet.bytes.bytes(), parsed);
  std::size_t rest = packet.bytes.size() - parsed.header_bytes;
  for (const CanFrame& frame : parsed.frames) rest -= frame.packet_bytes;
  if (!whole.ok()) {
    counts_.malformed_bytes += rest;
    ++counts_.malformed_messages;
    tell(FaultKind::Malformed, received, 1, out, whole.error().message);
  }
  if (parsed.datagram_sequence && !takes_datagram(*parsed.datagram_sequence, received, out)) {
    counts_.ignored_bytes += packet.bytes.size() - rest;
    return;
  }
  std::uint64_t* header = &counts_.ignored_bytes;
  for (const CanFrame& frame : parsed.frames) {
    ++counts_.of(frame.is_error ? "error" : name(frame));
    switch (take_any(frame, received, out)) {
      case Use::Decoded:
        counts_.decoded_bytes += frame.packet_bytes;
        header = &counts_.decoded_bytes;
        break;
      case Use::Ignored:
        counts_.ignored_bytes += frame.packet_bytes;
        break;
      case Use::Malformed:
        counts_.malformed_bytes += frame.packet_bytes;
        ++counts_.malformed_messages;
        break;
    }
  }
  *header += parsed.header_bytes;
}

/// Follows the gateway's counter. Returns false for a datagram that came before.
bool CanDecoder::takes_datagram(std::uint8_t sequence, HostTime received, std::vector<Measurement>& out) {
  const std::int64_t ahead = datagram_ ? CounterRange{0, 256}.steps(*datagram_, sequence) : 1;
  if (ahead == 0 || ahead > 192) {
    tell(FaultKind::Spurious, received, 1, out,
         fmt::format("the gateway's datagram {} came again or late: not used", sequence));
    return false;
  }
  if (ahead > 1)
    tell(FaultKind::Lost, received, static_cast<std::uint64_t>(ahead - 1), out,
         fmt::format("{} datagrams of the gateway are missing", ahead - 1));
  datagram_ = sequence;
  return true;
}

CanDecoder::Use CanDecoder::take_any(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) {
  if (frame.is_error) {
    take_error(frame, received, out);
    return Use::Decoded;
  }
  if (is_off_) {
    is_off_ = false;
    tell(FaultKind::Reconnected, received, 1, out, "frames come again after bus-off");
  }
  return frame.is_remote ? Use::Ignored : take(frame, received, out);
}

void CanDecoder::take_error(const CanFrame& frame, HostTime received, std::vector<Measurement>& out) {
  for (CanTrouble& trouble : explain_can_error(frame)) {
    if (trouble.kind == FaultKind::Disconnected || trouble.kind == FaultKind::Reconnected) {
      const bool is_off = trouble.kind == FaultKind::Disconnected;
      if (is_off != is_off_) tell(trouble.kind, received, 1, out, std::move(trouble.detail));
      is_off_ = is_off;
    } else {
      tell(trouble.kind, received, 1, out, std::move(trouble.detail));
    }
  }
}

}  // namespace hueline::drivers
