#include "drivers/pps/pps_decoder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <vector>

#include "drivers/pps/as_stamped.hpp"

namespace hueline::drivers {
std::string PpsDecoder::Config::validate() const {
  if (edge != PpsEdgeKind::Assert && edge != PpsEdgeKind::Clear) return "edge: assert or clear";
  return {};
}

void PpsDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  const auto bytes = packet.bytes.bytes();
  const auto decoded = decode_pps(bytes);
  if (!decoded) {
    counts_.malformed_bytes += bytes.size();
    ++counts_.malformed_messages;
    out.push_back(Fault{packet.sensor, FaultKind::Malformed, packet.received, 1, decoded.error().message});
    return;
  }
  ++counts_.messages[name(decoded->edge)];
  if (decoded->edge != config_.edge) {
    counts_.ignored_bytes += bytes.size();
    return;
  }
  const auto fault = [&](FaultKind kind, std::uint64_t count, std::string detail) {
    out.push_back(Fault{packet.sensor, kind, packet.received, count, std::move(detail)});
  };
  const std::uint64_t sequence = decoded->sequence;
  if (last_sequence_ && sequence == *last_sequence_) {
    counts_.ignored_bytes += bytes.size();
    return fault(FaultKind::Spurious, 1, fmt::format("PPS edge {} came twice", sequence));
  }
  if (last_sequence_ && sequence < *last_sequence_)
    fault(FaultKind::Spurious, 1, fmt::format("PPS edge count fell from {} to {}", *last_sequence_, sequence));
  else if (last_sequence_ && sequence - *last_sequence_ > 1)
    fault(FaultKind::Lost, sequence - *last_sequence_ - 1,
          fmt::format("PPS edges lost between {} and {}", *last_sequence_, sequence));
  last_sequence_ = sequence;
  // Ingest sets `received` to the arrival if the edge's own stamp is impossible. Then the time of the edge is not
  // known.
  const double off_s = to_seconds(decoded->time.time_since_epoch()) - to_seconds(packet.received.time_since_epoch());
  if (std::abs(off_s) > kReceivedAsStamped_s) {
    counts_.ignored_bytes += bytes.size();
    return fault(FaultKind::Spurious, 1,
                 fmt::format("PPS edge {} is stamped {:+.3f} s off its arrival: not used", sequence, off_s));
  }
  counts_.decoded_bytes += bytes.size();
  out.push_back(PpsEdge{packet.sensor, decoded->time, sequence});
}

}  // namespace hueline::drivers
