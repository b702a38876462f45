#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/decoder.hpp"
#include "drivers/pps/ptp_packet.hpp"

namespace hueline::drivers {

/// What a PTP clock counts.
enum class PtpScale : std::uint8_t {
  Tai,  ///< TAI since 1970, as PTP (IEEE 1588) does
  Utc,  ///< Unix time: a clock that phc2sys or a grandmaster of an arbitrary scale sets
};

/// Makes of each reading of a PTP clock the edge of its latest second (PpsEdge) and the name of that second
/// (TimeLabel). Use one decoder for each sensor. Its result depends on the packets and the scale only.
/// Thread safety: none; one thread calls all functions.
///
/// Faults:
/// - Lost: the reading came so long after its second that the computer's clock may have drifted meanwhile (not used).
/// - NoTime: the clock shows a time before 2020, so nobody has set it. Its seconds are no edges and have no name.
/// - Spurious: a reading came again, or the computer's clock took long for it (not used).
/// - Malformed: wrong size or magic.
class PtpDecoder final : public Decoder {
 public:
  explicit PtpDecoder(PtpScale scale) : scale_(scale) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_sequence_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  const PtpScale scale_;
  std::optional<std::uint64_t> last_sequence_;
  bool is_unset_ = false;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
