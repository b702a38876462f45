#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "storage/journal_header.hpp"
#include "storage/journal_reader.hpp"
#include "sync/clock_relation.hpp"

namespace hueline::runtime {

/// One of the recordings that are merged, and what becomes of its packets.
struct MergeInput {
  std::string name;  ///< for messages
  std::unique_ptr<storage::JournalReader> journal;
  std::vector<std::optional<SensorId>> sensors;  ///< by its SensorId: which it becomes; empty: left out; [0] is 0
  sync::ClockRelation clock;                     ///< from its computer's clock to that of the first recording
  bool begins_late = false;                      ///< see LedgerJoin::Input
  bool is_ring = false;                          ///< likewise
  bool has_ticks = false;                        ///< its ticks are kept
};

/// What was written, and what of each recording was not.
struct MergedJournal {
  struct Input {
    std::uint64_t packets = 0;      ///< written
    std::uint64_t left_out = 0;     ///< of sensors that are left out, ticks of the other computers
    std::uint64_t missing = 0;      ///< of the sensors that are kept, as its ledgers say
    std::uint64_t unexplained = 0;  ///< missing behind its last ledger; of which sensor is not known
    std::uint64_t ledgers = 0, contradictions = 0;
    std::uint64_t damages = 0;     ///< damaged chunks that were skipped, and segments that are missing
    std::string first_damage;      ///< empty if nothing was damaged
    Status end;                    ///< ok, or how the recording ends if it does not end well
    nanoseconds largest_sigma{0};  ///< of the restated times of its packets
  };
  std::vector<Input> inputs;
  std::uint64_t packets = 0, bytes = 0;  ///< written, and bytes of their payloads
};

/// Writes the packets of several recordings of one drive as one recording. Memory does not grow with the recordings: of
/// each one packet and its chunk are held.
///
/// - The clock is that of the first recording; `received` of the others is restated by their relations. Payloads keep
///   their bytes.
/// - Each recording keeps its own order. Between them the packet goes first whose recording has reached the earlier
///   time, and of two at the same time that of the recording that is named first. So the result depends on the
///   recordings alone.
/// - Ticks come from one computer: they say how much room its disk has. Faults and commands come from all.
/// - The ledgers are written anew (LedgerJoin), after each ledger of a recording and at the end. A recording that was
///   cut, or that lacks packets of which no ledger says whose they were, is told by a fault Lost of hueline itself.
///
/// The file is written as `to`.part and renamed when it is whole; a failed or stopped merge removes it. Errors: of the
/// new file; Stopped; Unsupported if a recording cannot be read again from its beginning. The recordings are only read.
/// `progress` is told from time to time how many bytes were read.
Result<MergedJournal> merge_journals(std::vector<MergeInput>& inputs, const storage::JournalHeader& header,
                                     const std::filesystem::path& to, std::stop_token stop,
                                     const std::function<void(std::uint64_t bytes_read)>& progress = {});

}  // namespace hueline::runtime
