#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/wire/seeded_random.hpp"
#include "sim/wire/timeline.hpp"

/// Faults between a device and the computer, applied to a Timeline. They are seeded: the same rules do the same damage.
namespace hueline::sim {

/// What can happen to an event on its way.
enum class WireFault : std::uint8_t {
  Drop,       ///< made but lost on the way; counts of PPS edges and images show a gap
  Miss,       ///< never made; later counts have no gap
  Duplicate,  ///< sent twice, the second time `delay_ns` later
  Corrupt,    ///< `corrupt_bytes` bytes of the payload are changed (datagrams and logs only)
  Delay,      ///< sent `delay_ns` later; later events may overtake it
  Truncate,   ///< the payload ends somewhere before its end (datagrams and logs only)
};

/// A fault that hits events of one channel: those that would have been sent in [begin_ns, end_ns) of drive time.
struct FaultRule {
  WireFault fault = WireFault::Drop;
  WireChannel channel = WireChannel::LaserData;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = INT64_MAX;
  double probability = 1.0;         ///< with which each event is hit
  std::int64_t delay_ns = 0;        ///< of Delay and Duplicate
  std::uint32_t corrupt_bytes = 1;  ///< of Corrupt; at least 1
  std::uint16_t log_id = 0;         ///< Pos: hits only this log (NovAtel message id); 0: every log

  /// Returns an empty text if the rule can be used, else a sentence that names the wrong key.
  std::string validate() const;
};

/// Applies one valid rule and sorts the events by time again. Returns how many events it hit.
std::size_t apply_rule(std::vector<WireEvent>& events, const FaultRule& rule, SeededRandom& random);

/// Applies the rules one after the other with random numbers from `seed`, and sorts the events by time again. Returns
/// how many events each rule hit. Errors: Invalid (a rule that `validate()` refuses).
Result<std::vector<std::size_t>> apply_faults(Timeline& timeline, const std::vector<FaultRule>& rules,
                                              std::uint64_t seed);

}  // namespace hueline::sim
