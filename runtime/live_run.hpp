#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "runtime/ingest.hpp"
#include "runtime/reader.hpp"
#include "runtime/recorder.hpp"

namespace hueline::runtime {

/// The threads of a capture: a reader for each source, the recorder, and the pipeline. Owns nothing that interprets
/// bytes.
class LiveRun {
 public:
  struct Config {
    PacketQueue::Limits record_queue{200'000, std::size_t{1} << 30};  ///< seconds of a stalled disk
    PacketQueue::Limits pipeline_queue{100'000, std::size_t{1} << 29};
    std::chrono::milliseconds pause_after{500};  ///< when no packet comes for so long, what has come goes to the disk
  };
  struct Source {
    SensorId sensor;
    std::string name;
    std::unique_ptr<PacketSource> source;
    Reader::Config reader;
    bool is_sheddable;
    std::function<HostTime()> now = {};  ///< stamps the reader's faults; empty: this computer's clock
  };

  /// `process` is called for each packet on the pipeline thread, in ingest order.
  LiveRun(std::vector<Source> sources, std::unique_ptr<storage::JournalWriter> journal,
          std::function<void(const Packet&)> process, Config config);
  ~LiveRun();

  void start();
  /// True when every reader has ended by itself (recordings as sources) or the recording failed: there is nothing to
  /// wait for.
  bool is_over() const;
  /// is_over(), waited for at most `time` and until `stop`.
  bool wait_until_over(std::chrono::milliseconds time, const std::stop_token& stop);
  /// Stops the readers, lets recorder and pipeline finish what has entered, closes the journal. What comes meanwhile of
  /// readers that are slow to leave is still recorded and flushed.
  ///
  /// `at_once`, then or later: nothing enters any more, the recorder has half a second for what waits for it and closes
  /// the journal, the pipeline leaves after the packet that it has, and readers are not waited for. Idempotent.
  void stop(const std::stop_token& at_once = {});

  /// The journal is closed: nothing more happens to drive.mcap. Thread-safe.
  bool is_recording_closed() const { return recording_closed_; }
  /// Packets that entered, but not drive.mcap, because the end was asked for at once; after stop().
  std::uint64_t packets_left_behind() const { return left_behind_; }
  /// Ended at once, the pipeline has not had all packets; after stop().
  bool are_products_cut() const { return products_cut_; }
  /// A device's library holds a reader: it cannot be joined. After stop().
  bool is_a_reader_stuck() const { return readers_left_ > 0; }

  /// The first refusal of the recording; ok while all is well. Thread-safe.
  Status recording() const;
  /// Why drive.mcap is no longer where it was made, though it is still written (Recorder::place). Thread-safe.
  Status place() const;
  const Ingest& ingest() const { return *ingest_; }
  Ingest& ingest() { return *ingest_; }
  std::uint64_t recorded_bytes() const { return recorded_bytes_.load(std::memory_order_relaxed); }
  /// Packets that are in drive.mcap for certain; after stop().
  std::uint64_t packets_recorded() const { return recorder_.packets_recorded(); }
  /// Packets that came after the last of them and are lost, if the recording failed; after stop().
  std::uint64_t packets_lost_at_the_end() const { return ingest_->next_sequence() - recorder_.end_sequence(); }
  std::size_t waiting_to_be_processed() const { return pipeline_.size(); }
  const std::vector<std::unique_ptr<Reader>>& readers() const { return readers_; }

 private:
  void record();
  void tell_place();
  Status record_until_the_end();
  void process_all();
  void hurry();

  const Config config_;
  PacketQueue record_, pipeline_;
  std::unique_ptr<Ingest> ingest_;
  std::vector<std::unique_ptr<Reader>> readers_;
  Recorder recorder_;
  const std::function<void(const Packet&)> process_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;  // readers_left_, recording_
  Status recording_, place_;
  std::atomic<std::uint64_t> recorded_bytes_{0};
  /// Nothing behind this sequence is processed: set when the recording fails, so that the cloud does not outgrow its
  /// record.
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
