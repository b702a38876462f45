#pragma once

#include <optional>
#include <string>

#include "core/decoder.hpp"
#include "drivers/pps/pps_packet.hpp"

namespace hueline::drivers {

/// PPS packets -> PpsEdge. Pure; one decoder a sensor; not thread-safe.
/// Only the configured edge becomes a measurement, the other one is counted as ignored. The gap between two sequence
/// numbers is Fault Lost with the number of edges; a repeated edge is Fault Spurious and dropped; a sequence that falls
/// is Fault Spurious (the source restarted without a reopen) and the edge is used; an edge whose packet was not
/// received when it says is Fault Spurious and not used. Wrong size, magic or edge: Fault Malformed.
class PpsDecoder : public Decoder {
 public:
  struct Config {
    PpsEdgeKind edge = PpsEdgeKind::Assert;  ///< the one that the receiver names as the second
    /// Empty when fine, else a sentence.
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
