#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "apps/ingest.hpp"
#include "apps/reader.hpp"
#include "apps/recorder.hpp"

namespace hueline::apps {

/// The threads of a capture: a reader for each source, the recorder, and the pipeline. Owns nothing that interprets bytes.
class LiveRun {
 public:
  struct Config {
    PacketQueue::Limits record_queue{200'000, std::size_t{1} << 30};   ///< seconds of a stalled disk
    PacketQueue::Limits pipeline_queue{100'000, std::size_t{1} << 29};
    std::chrono::milliseconds flush_period{1000};  ///< recorded data older than this have been given to the disk
  };
  struct Source {
    SensorId sensor;
    std::string name;
    std::unique_ptr<PacketSource> source;
    Reader::Config reader;
    bool is_sheddable;
  };

  /// `process` is called for each packet on the pipeline thread, in ingest order.
  LiveRun(std::vector<Source> sources, std::unique_ptr<storage::JournalWriter> journal,
          std::function<void(const Packet&)> process, Config config);
  ~LiveRun();

  void start();
  /// True when every reader has ended by itself (recordings as sources) or the recording failed: there is nothing to wait for.
  bool is_over() const;
  /// Stops the readers, lets recorder and pipeline finish what has entered, closes the journal. Idempotent.
  void stop();

  /// The first refusal of the recording; ok while all is well. Thread-safe.
  Status recording() const;
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
  void record(std::stop_token stop);
  void process_all();

  const Config config_;
  PacketQueue record_, pipeline_;
  std::unique_ptr<Ingest> ingest_;
  std::vector<std::unique_ptr<Reader>> readers_;
  Recorder recorder_;
  const std::function<void(const Packet&)> process_;
  mutable std::mutex mutex_;
  Status recording_;
  std::atomic<std::uint64_t> recorded_bytes_{0};
  /// Nothing behind this sequence is processed: set when the recording fails, so that the cloud does not outgrow its record.
  std::atomic<std::uint64_t> recorded_up_to_{~std::uint64_t{0}};
  std::vector<std::jthread> reader_threads_;
  std::jthread recorder_thread_, pipeline_thread_;
  std::atomic<std::size_t> readers_left_{0};
  bool stopped_ = false;
};

}  // namespace hueline::apps
