#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/packet.hpp"
#include "runtime/ledger.hpp"

namespace hueline::runtime {

/// Joins the ledgers of several recordings whose packets become one recording, so that `hueline verify` finds in that
/// one what was missing in each of them, by the names of the sensors.
///
/// The sequence of the joined recording counts, as that of any, what has entered: packets, packets that are missing,
/// and packets that were refused. What is missing in a recording is known at its next ledger, and its place in the
/// sequence is there. Packets of sensors that are left out do not count.
/// Thread safety: none; one thread calls all functions.
class LedgerJoin {
 public:
  /// One of the recordings.
  struct Input {
    std::vector<std::optional<SensorId>> sensors;  ///< by its SensorId: which it becomes; empty: left out
    /// Its first ledgers count what a ring has removed, or what came before the file that was named.
    bool begins_late = false;
    /// What is missing was removed by a ring, on purpose: it is not told as missing.
    bool is_ring = false;
  };
  /// `sensors` is the number of sensors of the joined recording, with hueline itself.
  LedgerJoin(std::size_t sensors, std::vector<Input> inputs);

  /// Takes a packet of a recording as it was read there, whether it will be kept or not. After a ledger returns true:
  /// now is the time to write total().
  bool take(std::size_t input, const Packet& packet);
  /// Notes that a packet, with its new sensor, goes into the joined recording, and returns its sequence.
  std::uint64_t keep(const Packet& packet);
  /// Ends all recordings: what their faults told as refused behind their last ledgers is counted. total() is then the
  /// last ledger to write.
  void finish();
  /// Leaves a gap in the sequence for packets of which it is not known whose they were. No ledger may follow.
  void leave_gap(std::uint64_t packets) { gap_ += packets; }

  const Ledger& total() const { return total_; }
  /// Returns how many packets are missing in a recording behind its last ledger, or in all of it if it has none, and
  /// were not told as refused. Of which sensor they were is not known.
  std::uint64_t unexplained(std::size_t input) const;
  /// Returns how many packets its ledgers say are missing, of the sensors that are kept.
  std::uint64_t missing(std::size_t input) const { return parts_[input].missing; }
  std::uint64_t ledgers(std::size_t input) const { return parts_[input].ledgers; }
  /// Returns how many of its ledgers contradict the packets around them.
  std::uint64_t contradictions(std::size_t input) const { return parts_[input].contradictions; }

 private:
  struct Part {
    Input input;
    std::optional<Ledger> last;
    std::vector<Ledger::Sensor> found;  // since last, by its SensorId
    std::uint64_t next = 0, gaps = 0;   // sequence expected; missing in it since last
    std::vector<std::uint64_t> told;    // refused since last, as faults tell it, by its SensorId
    std::uint64_t missing = 0, ledgers = 0, contradictions = 0;
    bool has_begun = false;
  };
  void take_ledger(Part& part, const Ledger& ledger);

  std::vector<Part> parts_;
  Ledger total_;
  std::uint64_t gap_ = 0;
};

}  // namespace hueline::runtime
