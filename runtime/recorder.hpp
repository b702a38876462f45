#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "storage/segmented_journal.hpp"

namespace hueline::runtime {

/// Writes the packets that the recorder's thread takes from its queue. Reads no clock.
/// Thread safety: none; one thread calls all functions.
class Recorder {
 public:
  explicit Recorder(std::unique_ptr<storage::SegmentedJournal> journal) : journal_(std::move(journal)) {}

  /// Takes a packet. `now` is the time of any clock that does not step. It decides when data goes from memory to the
  /// kernel and to the medium, independently of the packets' stamps. The first error ends the recording: no packet may
  /// be given afterwards.
  Status take(const Packet& packet, std::chrono::nanoseconds now);
  /// Writes what is due at `now`. Call it again and again while no packet comes. Errors: those of take().
  Status rest(std::chrono::nanoseconds now);
  /// Writes everything to the medium, with summary and indexes.
  Status close();

  /// Returns why the recording is no longer where it was created: somebody deleted, moved or replaced it, though it is
  /// still written. Ok if it is there. This is checked every second and at the end.
  const Status& place() const { return place_; }
  std::uint64_t packets_taken() const { return taken_; }

  const storage::SegmentedJournal& journal() const { return *journal_; }
  std::vector<storage::SegmentedJournal::News> take_news() { return journal_->take_news(); }
  std::uint64_t bytes_written() const { return journal_->bytes_written(); }
  /// Packets that are certainly in the file. Valid after close().
  std::uint64_t packets_recorded() const { return journal_->packets_on_medium(); }
  /// Returns the sequence of the first packet that is not recorded, whether that packet came or not. All packets below
  /// it are recorded or were refused by the recorder's queue.
  std::uint64_t end_sequence() const;

 private:
  static constexpr std::chrono::nanoseconds kLookEvery = std::chrono::seconds(1);
  Status look_sometimes(std::chrono::nanoseconds now);
  Status look();
  struct Gap {
    std::uint64_t packets_before, size;
  };
  std::unique_ptr<storage::SegmentedJournal> journal_;
  std::optional<std::chrono::nanoseconds> looked_;  // by the clock of take()
  std::uint64_t taken_ = 0, next_sequence_ = 0;
  std::vector<Gap> gaps_;  // gaps in the sequences
  Status place_;
};

}  // namespace hueline::runtime
