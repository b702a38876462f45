#include "runtime/live_run.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "drivers/transport/host_clock.hpp"
#include "runtime/thread_name.hpp"

namespace hueline::runtime {

LiveRun::LiveRun(std::vector<Source> sources, std::unique_ptr<storage::SegmentedJournal> journal,
                 std::function<void(const Packet&)> process, Config config)
    : config_(config),
      record_(config.record_queue),
      pipeline_(config.pipeline_queue),
      recorder_(std::move(journal)),
      process_(std::move(process)) {
  std::vector<Ingest::Sensor> sensors(1);
  for (const auto& source : sources) {
    if (sensors.size() <= source.sensor) sensors.resize(source.sensor + 1u);
    sensors[source.sensor].is_sheddable = source.is_sheddable;
  }
  ingest_ = std::make_unique<Ingest>(std::move(sensors), record_, pipeline_, config.pipeline_queue);
  for (auto& source : sources)
    readers_.push_back(std::make_unique<Reader>(source.sensor, source.name, std::move(source.source), source.reader,
                                                *ingest_, source.now ? source.now : drivers::host_now));
}

LiveRun::~LiveRun() { stop(); }

void LiveRun::start() {
  recorder_thread_ = std::jthread([this] { record(); });
  pipeline_thread_ = std::jthread([this] { process_all(); });
  readers_left_ = readers_.size();
  for (const auto& reader : readers_)
    reader_threads_.emplace_back([this, reader = reader.get()](std::stop_token stop) {
      name_this_thread("read " + reader->sensor_name());
      reader->run(stop);
      Lock lock(mutex_);
      --readers_left_;
      changed_.notify_all();
    });
}

bool LiveRun::is_over() const { return readers_left_ == 0 || !recording().ok(); }

bool LiveRun::wait_until_over(std::chrono::milliseconds time, const std::stop_token& stop) {
  Lock lock(mutex_);
  return changed_.wait_for(lock, stop, time,
                           [this]() HUELINE_REQUIRES(mutex_) { return readers_left_ == 0 || !recording_.ok(); });
}

Status LiveRun::recording() const {
  Lock lock(mutex_);
  return recording_;
}

void LiveRun::record() {
  name_this_thread("recorder");
  const Status done = record_until_the_end();
  const Status closed = recorder_.close();
  recorded_bytes_.store(recorder_.bytes_written(), std::memory_order_relaxed);
  recording_closed_ = true;
  Lock lock(mutex_);
  if (place_.ok()) place_ = recorder_.place();
  if (recording_.ok()) recording_ = done.ok() ? closed : done;
  changed_.notify_all();
}

/// Reports once that the recording was taken away, also in the recording itself, for the person who saves it.
void LiveRun::tell_place() {
  if (recorder_.place().ok() || !place().ok()) return;
  {
    Lock lock(mutex_);
    place_ = recorder_.place();
  }
  ingest_->submit(Fault{kSystemSensor, FaultKind::DiskFull, drivers::host_now(), recorder_.packets_taken(),
                        recorder_.place().error().message});
}

void LiveRun::keep_news() {
  auto news = recorder_.take_news();
  if (news.empty()) return;
  Lock lock(mutex_);
  std::ranges::move(news, std::back_inserter(news_));
}

std::vector<storage::SegmentedJournal::News> LiveRun::take_news() {
  Lock lock(mutex_);
  return std::exchange(news_, {});
}

Status LiveRun::place() const {
  Lock lock(mutex_);
  return place_;
}

Status LiveRun::record_until_the_end() {
  constexpr std::chrono::milliseconds kInAHurry{500};
  std::optional<std::chrono::steady_clock::time_point> hurries_since;
  while (!record_.is_drained()) {
    const auto packet = record_.pop_within(config_.rest_every);
    const auto now = std::chrono::steady_clock::now();
    if (packet && hurries_) {
      if (!hurries_since) hurries_since = now;
      if (now - *hurries_since > kInAHurry) {
        recorded_up_to_ = (*packet)->sequence;
        do ++left_behind_;
        while (record_.pop());
        break;
      }
    }
    const Status done =
        packet ? recorder_.take(**packet, now.time_since_epoch()) : recorder_.rest(now.time_since_epoch());
    recorded_bytes_.store(recorder_.bytes_written(), std::memory_order_relaxed);
    keep_news();
    if (done.ok()) {
      tell_place();
      continue;
    }
    if (packet) recorded_up_to_ = (*packet)->sequence;
    {
      Lock lock(mutex_);
      recording_ = done;
      changed_.notify_all();
    }
    record_.close();  // packets of readers are refused and counted from now on; the command ends the capture
    while (record_.pop()) {
    }
    return done;
  }
  return {};
}

void LiveRun::process_all() {
  name_this_thread("pipeline");
  while (auto packet = pipeline_.pop()) {
    if (hurries_) {
      products_cut_ = true;
      break;
    }
    if ((*packet)->sequence < recorded_up_to_.load(std::memory_order_relaxed)) process_(**packet);
  }
}

void LiveRun::hurry() {
  hurries_ = true;
  record_.close();
  pipeline_.close();
}

void LiveRun::stop(const std::stop_token& at_once) {
  if (stopped_) return;
  stopped_ = true;
  const std::stop_callback hurry_then(at_once, [this] { hurry(); });
  for (auto& thread : reader_threads_) thread.request_stop();
  {
    Lock lock(mutex_);
    changed_.wait(lock, at_once, [this] { return readers_left_ == 0; });
  }
  ingest_->tell_the_rest(at_once);
  record_.close();
  pipeline_.close();
  if (recorder_thread_.joinable()) recorder_thread_.join();
  if (pipeline_thread_.joinable()) pipeline_thread_.join();
}

}  // namespace hueline::runtime
