#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/mutex.hpp"

namespace hueline::apps {

/// Lets the program wait for SIGINT, SIGTERM and SIGHUP (a closed terminal) instead of being interrupted by them.
///
/// The first signal requests the usual end: what has come is finished. The second requests an end at once: the program
/// has one second to end by itself; after that it exits with status kStopped while its threads still run. A third makes
/// it exit immediately. Signals within half a second of each other count as one request, because `timeout` signals the
/// process and its group, and a closing terminal signals together with its shell. Under `nohup` SIGHUP requests
/// nothing.
///
/// Construct this object before any thread starts. The threads inherit the blocked signals, and so do programs that are
/// started unless their mask is set. One instance a process. Thread-safe.
class StopSignals {
 public:
  StopSignals();
  /// The signals stay blocked. A signal that comes now finds the work done.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Lets the end last at most this long after the first request. Then it is as if a second one had come. Call it
  /// before the work begins. 0: as long as it takes.
  void end_within(std::chrono::milliseconds time) { end_within_ms_ = time.count(); }

  /// Waits at most `time` for a request to stop. Returns true once there was one.
  bool wait_for(std::chrono::milliseconds time) const;
  /// Returns the token of the first request. Callbacks run on a thread of this object.
  std::stop_token asked() const { return asked_.get_token(); }
  /// Returns the token of the second request.
  std::stop_token at_once() const { return at_once_.get_token(); }

  /// Work that must not be cut off while this object lives. An end at once waits for it, at most five seconds.
  class Duty {
   public:
    /// Both functions are called on a thread of `signals`. `last_words` returns one line that says what is whole and
    /// what is not.
    Duty(StopSignals& signals, std::function<bool()> is_done, std::function<std::string()> last_words);
    ~Duty();
    Duty(const Duty&) = delete;
    Duty& operator=(const Duty&) = delete;

   private:
    friend class StopSignals;
    StopSignals& signals_;
    const std::function<bool()> is_done_;
    const std::function<std::string()> last_words_;
  };

 private:
  void watch(const std::stop_token& over);
  bool has_done_its_duty();
  [[noreturn]] void leave();

  std::stop_source asked_, at_once_;
  std::atomic<std::int64_t> end_within_ms_{0};
  Mutex mutex_;
  Duty* duty_ HUELINE_GUARDED_BY(mutex_) = nullptr;
  std::jthread watcher_;
};

}  // namespace hueline::apps
