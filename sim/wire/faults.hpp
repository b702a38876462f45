#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/wire/seeded_random.hpp"
#include "sim/wire/timeline.hpp"

/// What goes wrong between a device and the computer, put into a Timeline. Seeded: the same rules give the same damage.
namespace hueline::sim {

enum class WireFault : std::uint8_t {
  Drop,       ///< made but lost on the way: counts of PPS edges and images show a gap
  Miss,       ///< never made: later counts close up
  Duplicate,  ///< sent twice, the copy `delay_ns` later
  Corrupt,    ///< `corrupt_bytes` bytes of the payload changed (datagrams and logs only)
  Delay,      ///< sent `delay_ns` later; what follows may overtake it
  Truncate,   ///< the payload ends somewhere in its middle (datagrams and logs only)
};

/// Applies `fault` to the events of one channel that would have been sent in [begin_ns, end_ns) of drive time.
struct FaultRule {
  WireFault fault = WireFault::Drop;
  WireChannel channel = WireChannel::LaserData;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = INT64_MAX;
  double probability = 1.0;         ///< of each event
  std::int64_t delay_ns = 0;        ///< Delay, Duplicate
  std::uint32_t corrupt_bytes = 1;  ///< Corrupt: at least 1
  std::uint16_t log_id = 0;         ///< Pos: only this log (NovAtel message id); 0: every log

  /// Empty if usable, else a sentence that names the key.
  std::string validate() const;
};

/// Applies one valid rule and restores the order of time. Returns how many events it hit.
std::size_t apply_rule(std::vector<WireEvent>& events, const FaultRule& rule, SeededRandom& random);

/// Applies the rules one after the other, draws from `seed`, restores the order of time. Returns how many events each
/// rule hit. Invalid: a rule's validate().
Result<std::vector<std::size_t>> apply_faults(Timeline& timeline, const std::vector<FaultRule>& rules,
                                              std::uint64_t seed);

}  // namespace hueline::sim
