#pragma once

#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "storage/journal_writer.hpp"

namespace hueline::apps {

/// What the recorder's thread does with each packet that it takes from its queue. Reads no clock. Thread-bound.
class Recorder {
 public:
  explicit Recorder(std::unique_ptr<storage::JournalWriter> journal) : journal_(std::move(journal)) {}

  /// `now`: of any clock that does not step; what lies in memory goes to the kernel and to the medium by it, however the packets are
  /// stamped. The first error ends the recording: nothing is to be taken afterwards.
  Status take(const Packet& packet, std::chrono::nanoseconds now);
  /// No packet came for a while: what was taken goes to the medium. Errors as of take().
  Status pause();
  /// Everything to the medium, with summary and indexes.
  Status close() { return journal_->close(); }

  std::uint64_t bytes_written() const { return journal_->bytes_written(); }
  /// Packets that are in the file for certain; after close().
  std::uint64_t packets_recorded() const { return journal_->packets_on_medium(); }
  /// Of the first packet that is not, if it came: all below are recorded, or were refused by the recorder's queue.
  std::uint64_t end_sequence() const;

 private:
  struct Gap {
    std::uint64_t packets_before, size;
  };
  std::unique_ptr<storage::JournalWriter> journal_;
  bool is_resting_ = false;
  std::uint64_t taken_ = 0, next_sequence_ = 0;
  std::vector<Gap> gaps_;  // in the sequences
};

}  // namespace hueline::apps
