#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/mutex.hpp"
#include "runtime/ingest.hpp"
#include "runtime/reader.hpp"
#include "runtime/recorder.hpp"

namespace hueline::runtime {

/// The threads of a capture: one reader for each source, the recorder and the pipeline. It interprets no bytes.
class LiveRun {
 public:
  struct Config {
    /// Holds the data of some seconds of a stalled disk.
    PacketQueue::Limits record_queue{200'000, std::size_t{1} << 30};
    PacketQueue::Limits pipeline_queue{100'000, std::size_t{1} << 29};
    /// If no packet comes for this long, the recorder looks whether what it has must be written.
    std::chrono::milliseconds rest_every{20};
  };
  /// A device or file, and how it is read.
  struct Source {
    SensorId sensor;
    std::string name;
    std::unique_ptr<PacketSource> source;
    Reader::Config reader;
    bool is_sheddable;
    std::function<HostTime()> now = {};  ///< stamps the reader's faults; empty: the clock of this computer
  };

  /// `process` is called on the pipeline thread for each packet, in ingest order.
  LiveRun(std::vector<Source> sources, std::unique_ptr<storage::SegmentedJournal> journal,
          std::function<void(const Packet&)> process, Config config);
  ~LiveRun();

  /// Starts all threads.
  void start();
  /// Returns true if there is nothing to wait for: every reader has ended by itself (recordings as sources), or the
  /// recording failed.
  bool is_over() const;
  /// Waits until is_over(), at most for `time` and until `stop`. Returns is_over().
  bool wait_until_over(std::chrono::milliseconds time, const std::stop_token& stop);
  /// Stops the readers, lets the recorder and the pipeline finish what has entered, and closes the journal. Packets
  /// that readers deliver while they are stopping are still recorded and processed. May be called again.
  ///
  /// `at_once` shortens this, whenever it is requested: nothing enters any more, the recorder has half a second for the
  /// packets that wait for it and then closes the journal, the pipeline leaves after its current packet, and the
  /// readers are not waited for.
  void stop(const std::stop_token& at_once = {});

  /// Returns true once the journal is closed, after which drive.mcap does not change any more. Thread-safe.
  bool is_recording_closed() const { return recording_closed_; }
  /// Packets that entered, but are not in drive.mcap because the end was requested at once. Valid after stop().
  std::uint64_t packets_left_behind() const { return left_behind_; }
  /// Returns whether the end was requested at once before the pipeline had processed all packets. Valid after stop().
  bool are_products_cut() const { return products_cut_; }
  /// Returns whether a reader cannot be joined because a device's library holds it. Valid after stop().
  bool is_a_reader_stuck() const { return readers_left_ > 0; }

  /// Returns the first error of the recording; ok while there is none. Thread-safe.
  Status recording() const;
  /// Returns why drive.mcap is no longer where it was created, though it is still written (Recorder::place).
  /// Thread-safe.
  Status place() const;
  /// Returns what happened to the files of the recording since the last call. Thread-safe.
  std::vector<storage::SegmentedJournal::News> take_news();
  const Ingest& ingest() const { return *ingest_; }
  Ingest& ingest() { return *ingest_; }
  std::uint64_t recorded_bytes() const { return recorded_bytes_.load(std::memory_order_relaxed); }
  /// Packets that are certainly in drive.mcap. Valid after stop().
  std::uint64_t packets_recorded() const { return recorder_.packets_recorded(); }
  /// Packets that came after the last recorded one and are lost, if the recording failed. Valid after stop().
  std::uint64_t packets_lost_at_the_end() const { return ingest_->next_sequence() - recorder_.end_sequence(); }
  /// The files of the recording. Valid after stop().
  const storage::SegmentedJournal& journal() const { return recorder_.journal(); }
  std::size_t waiting_to_be_processed() const { return pipeline_.size(); }
  /// Return the packets and their bytes that wait for the recorder and for the pipeline. Thread-safe.
  std::pair<std::size_t, std::size_t> waiting_to_be_recorded() const { return {record_.size(), record_.weight()}; }
  std::pair<std::size_t, std::size_t> waiting_in_pipeline() const { return {pipeline_.size(), pipeline_.weight()}; }
  const std::vector<std::unique_ptr<Reader>>& readers() const { return readers_; }

 private:
  void record();
  void tell_place();
  void keep_news();
  Status record_until_the_end();
  void process_all();
  void hurry();

  const Config config_;
  PacketQueue record_, pipeline_;
  std::unique_ptr<Ingest> ingest_;
  std::vector<std::unique_ptr<Reader>> readers_;
  Recorder recorder_;
  const std::function<void(const Packet&)> process_;
  mutable Mutex mutex_;
  std::condition_variable_any changed_;  // notified when readers_left_ or recording_ changes
  Status recording_ HUELINE_GUARDED_BY(mutex_), place_ HUELINE_GUARDED_BY(mutex_);
  std::vector<storage::SegmentedJournal::News> news_ HUELINE_GUARDED_BY(mutex_);
  std::atomic<std::uint64_t> recorded_bytes_{0};
  /// No packet from this sequence on is processed. Set when the recording fails, so that the cloud does not contain
  /// more than the recording.
  std::atomic<std::uint64_t> recorded_up_to_{~std::uint64_t{0}};
  std::atomic<bool> hurries_{false}, recording_closed_{false};
  std::atomic<std::uint64_t> left_behind_{0};
  std::atomic<bool> products_cut_{false};
  std::atomic<std::size_t> readers_left_{0};
  bool stopped_ = false;
  std::vector<std::jthread> reader_threads_;
  std::jthread recorder_thread_, pipeline_thread_;
};

}  // namespace hueline::runtime
