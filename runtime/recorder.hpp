#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "storage/journal_writer.hpp"

namespace hueline::runtime {

/// What the recorder's thread does with each packet that it takes from its queue. Reads no clock. Thread-bound.
class Recorder {
 public:
  explicit Recorder(std::unique_ptr<storage::JournalWriter> journal) : journal_(std::move(journal)) {}

  /// `now`: of any clock that does not step; what lies in memory goes to the kernel and to the medium by it, however
  /// the packets are stamped. The first error ends the recording: nothing is to be taken afterwards.
  Status take(const Packet& packet, std::chrono::nanoseconds now);
  /// No packet came for a while: what was taken goes to the medium. Errors as of take().
  Status pause();
  /// Everything to the medium, with summary and indexes.
  Status close();

  /// Why the recording is no longer where it was made: somebody has deleted, moved or replaced it, though it is still
  /// written. Ok: it is there. Looked at every second, when packets pause, and at the end.
  const Status& place() const { return place_; }
  std::uint64_t packets_taken() const { return taken_; }

  std::uint64_t bytes_written() const { return journal_->bytes_written(); }
  /// Packets that are in the file for certain; after close().
  std::uint64_t packets_recorded() const { return journal_->packets_on_medium(); }
  /// Of the first packet that is not, if it came: all below are recorded, or were refused by the recorder's queue.
  std::uint64_t end_sequence() const;

 private:
  static constexpr std::chrono::nanoseconds kLookEvery = std::chrono::seconds(1);
  Status look();
  struct Gap {
    std::uint64_t packets_before, size;
  };
  std::unique_ptr<storage::JournalWriter> journal_;
  bool is_resting_ = false;
  std::optional<std::chrono::nanoseconds> looked_;  // by the clock of take()
  std::uint64_t taken_ = 0, next_sequence_ = 0;
  std::vector<Gap> gaps_;  // in the sequences
  Status place_;
};

}  // namespace hueline::runtime
