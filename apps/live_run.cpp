#include "apps/live_run.hpp"

#include "apps/thread_name.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::apps {

LiveRun::LiveRun(std::vector<Source> sources, std::unique_ptr<storage::JournalWriter> journal,
                 std::function<void(const Packet&)> process, Config config)
    : config_(config),
      record_(config.record_queue),
      pipeline_(config.pipeline_queue),
      recorder_(std::move(journal), config.flush_period),
      process_(std::move(process)) {
  std::vector<Ingest::Sensor> sensors(1);
  for (const auto& source : sources) {
    if (sensors.size() <= source.sensor) sensors.resize(source.sensor + 1u);
    sensors[source.sensor].is_sheddable = source.is_sheddable;
  }
  ingest_ = std::make_unique<Ingest>(std::move(sensors), record_, pipeline_, config.pipeline_queue);
  for (auto& source : sources)
    readers_.push_back(std::make_unique<Reader>(source.sensor, source.name, std::move(source.source), source.reader, *ingest_,
                                                drivers::host_now));
}

LiveRun::~LiveRun() { stop(); }

void LiveRun::start() {
  recorder_thread_ = std::jthread([this](std::stop_token stop) { record(stop); });
  pipeline_thread_ = std::jthread([this] { process_all(); });
  readers_left_ = readers_.size();
  for (const auto& reader : readers_)
    reader_threads_.emplace_back([this, reader = reader.get()](std::stop_token stop) {
      name_this_thread("read " + reader->sensor_name());
      reader->run(stop);
      --readers_left_;
    });
}

bool LiveRun::is_over() const { return readers_left_ == 0 || !recording().ok(); }

Status LiveRun::recording() const {
  std::lock_guard lock(mutex_);
  return recording_;
}

void LiveRun::record(std::stop_token) {
  name_this_thread("recorder");
  while (auto packet = record_.pop()) {
    const std::uint64_t sequence = (*packet)->sequence;
    const Status done = recorder_.take(**packet, std::chrono::steady_clock::now().time_since_epoch());
    recorded_bytes_.store(recorder_.bytes_written(), std::memory_order_relaxed);
    if (done.ok()) continue;
    recorded_up_to_ = sequence;
    {
      std::lock_guard lock(mutex_);
      recording_ = done;
    }
    record_.close();  // readers see their packets refused and counted; main ends the capture
    while (record_.pop()) {
    }
    break;
  }
  const Status closed = recorder_.close();
  recorded_bytes_.store(recorder_.bytes_written(), std::memory_order_relaxed);
  std::lock_guard lock(mutex_);
  if (recording_.ok()) recording_ = closed;
}

void LiveRun::process_all() {
  name_this_thread("pipeline");
  while (auto packet = pipeline_.pop())
    if ((*packet)->sequence < recorded_up_to_.load(std::memory_order_relaxed)) process_(**packet);
}

void LiveRun::stop() {
  if (stopped_) return;
  stopped_ = true;
  for (auto& thread : reader_threads_) thread.request_stop();
  for (auto& thread : reader_threads_) thread.join();
  ingest_->tell_the_rest({});
  record_.close();
  pipeline_.close();
  if (recorder_thread_.joinable()) recorder_thread_.join();
  if (pipeline_thread_.joinable()) pipeline_thread_.join();
}

}  // namespace hueline::apps
