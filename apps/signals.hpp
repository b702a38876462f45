#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace hueline::apps {

/// SIGINT, SIGTERM and SIGHUP (a closed terminal) as something to wait for, not something that interrupts.
///
/// The first of them asks for the usual end: what has come is finished. A second one asks for an end at once: the
/// program has a second to end by itself, then it is ended over the heads of its threads with status kStopped. A third
/// one does that without the second. What comes within half a second of an ask is the same ask, told twice: by
/// `timeout` to the process and its group, by a closing terminal and its shell. Under `nohup` SIGHUP asks for nothing.
///
/// Construct it before any thread starts: the threads inherit the block, and so do programs that are started unless
/// their mask is set. One instance a process. Thread-safe.
class StopSignals {
 public:
  StopSignals();
  /// The signals stay blocked: whatever comes now finds the work done.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// True once a stop was asked for; waits for that at most `time`.
  bool wait_for(std::chrono::milliseconds time) const;
  /// Stopped by the first of them. Callbacks run on a thread of this object.
  std::stop_token asked() const { return asked_.get_token(); }
  /// Stopped by the second of them.
  std::stop_token at_once() const { return at_once_.get_token(); }

  /// What must not be cut off while this object lives: an end at once waits for it, five seconds at most.
  class Duty {
   public:
    /// Both are called on a thread of `signals`. `last_words` says what is whole and what is not, in one line.
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
  std::mutex mutex_;
  Duty* duty_ = nullptr;
  std::jthread watcher_;
};

}  // namespace hueline::apps
