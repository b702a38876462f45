#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "drivers/pps/pps_packet.hpp"

namespace hueline::drivers {

/// Makes a PpsEdge of each PPS packet. Use one decoder for each sensor. Its result depends on the packets and Config
/// only.
/// Thread safety: none; one thread calls all functions.
///
/// Only the configured edge becomes a measurement; the other one is counted as ignored. Faults:
/// - Lost: a gap between two sequence numbers, with the number of edges.
/// - Spurious: an edge came again (dropped), the sequence number fell, because the source restarted without a reopen
///   (the edge is used), or the packet was not received at the time of the edge (not used).
/// - Malformed: wrong size, magic or edge.
class PpsDecoder : public Decoder {
 public:
  struct Config {
    PpsEdgeKind edge = PpsEdgeKind::Assert;  ///< the edge that is the second
    /// Returns an empty text if all values are allowed, else a sentence.
    std::string validate() const;
  };
  explicit PpsDecoder(Config config) : config_(config) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_sequence_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  const Config config_;
  std::optional<std::uint64_t> last_sequence_;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
