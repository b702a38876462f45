#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/packet.hpp"

namespace hueline::runtime {

/// What has entered the journal and what was refused, by sensor, up to a place in its order. Ingest writes it into the
/// journal, so that a reader can prove that nothing is missing, or say of which sensor how much is. The bytes are in
/// docs/formats.md.
struct Ledger {
  struct Sensor {
    std::uint64_t packets = 0, bytes = 0;  ///< given to the recorder; bytes: the payloads
    std::uint64_t wire = 0;                ///< of the packets: those of the device itself, PacketKind::Wire
    std::uint64_t shed = 0;                ///< of the packets: recorded, but not fused live
    std::uint64_t refused = 0;             ///< packets for which the recorder's queue had no room
    std::uint64_t refused_wire = 0;        ///< of those: PacketKind::Wire
    bool operator==(const Sensor&) const = default;
  };
  std::vector<Sensor> sensors;  ///< by SensorId; [0] is hueline itself
  bool operator==(const Ledger&) const = default;
};

/// Returns the bytes of a packet of PacketKind::Ledger.
std::vector<std::byte> encode_ledger(const Ledger& ledger);
/// Errors: Malformed if the bytes are no ledger, Unsupported if they are one of a later version.
Result<Ledger> decode_ledger(std::span<const std::byte> bytes);

/// Compares the packets of a recording with the ledgers in it. For each sensor, what had entered is the sum of what is
/// here, what was refused, what is missing and what was removed on purpose.
/// Thread safety: none; one thread calls all functions.
class LedgerCheck {
 public:
  /// What is known of a sensor. `received` is the sum of the other numbers of packets.
  struct Account {
    std::uint64_t received = 0;  ///< packets that entered
    std::uint64_t here = 0;      ///< in the recording
    std::uint64_t refused = 0;   ///< the recorder's queue had no room
    std::uint64_t missing = 0;   ///< given to the recorder, and not here
    std::uint64_t removed = 0;   ///< removed by a ring, or came before the file that was named
    std::uint64_t bytes = 0;     ///< of the payloads that are here
    std::uint64_t wire = 0;      ///< of those here: packets of the device itself
    std::uint64_t shed = 0;      ///< of those here: not fused live
    std::uint64_t refused_wire = 0;
  };

  /// `begins_late`: the beginning of the recording was removed on purpose, as a ring does.
  explicit LedgerCheck(bool begins_late);
  /// Takes the packets of the recording, in their order.
  void take(const Packet& packet);
  /// Closes the accounts. Call it once, after the last packet. `by_ring`: how many packets the ring says that it has
  /// removed. It does not say of which sensors they were, so they are told from missing ones by their sum alone.
  void finish(std::uint64_t by_ring = 0);

  const std::vector<Account>& accounts() const { return accounts_; }  ///< by SensorId; valid after finish()
  std::uint64_t missing() const;                                      ///< sum of Account::missing
  std::uint64_t removed() const;                                      ///< sum of Account::removed
  std::uint64_t ledgers() const { return ledgers_; }
  /// Returns how many ledgers contradict the packets around them: more packets or other bytes than had entered, or sums
  /// that are not the ledger's place in the order.
  std::uint64_t contradictions() const { return contradictions_; }
  /// Packets behind the last ledger. Of these nothing can be proved but that their sequence has no gap.
  std::uint64_t behind_the_last() const { return behind_; }
  /// Packets that are missing in the sequence behind the last ledger, or in all of it if there is no ledger. It is not
  /// known of which sensors they were, and whether they were recorded.
  std::uint64_t gaps_behind_the_last() const { return gaps_behind_; }

 private:
  void compare(const Ledger& ledger, std::uint64_t sequence);
  Account& account(std::size_t sensor);

  std::optional<Ledger> last_;
  std::vector<Ledger::Sensor> found_;  // since last_; packets and bytes only
  std::vector<Account> accounts_;
  std::uint64_t ledgers_ = 0, contradictions_ = 0, behind_ = 0, gaps_behind_ = 0;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace hueline::runtime
