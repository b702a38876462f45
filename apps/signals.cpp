#include "apps/signals.hpp"

#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <ctime>
#include <optional>
#include <utility>

#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "runtime/thread_name.hpp"

namespace hueline::apps {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kSameAsk{500}, kToEndByItself{1000}, kForItsDuty{5000}, kLook{20};

sigset_t stop_set() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  // sigwaitinfo() returns a blocked signal even if it is ignored, so the disposition that nohup has set is checked
  // here.
  struct sigaction hang_up {};
  if (sigaction(SIGHUP, nullptr, &hang_up) != 0 || hang_up.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);
  return set;
}

/// Returns true if a signal came within `time`. Without `time` it waits for one.
bool comes(const std::optional<std::chrono::milliseconds>& time) {
  const sigset_t set = stop_set();
  if (!time) return sigwaitinfo(&set, nullptr) > 0;
  const timespec limit{time->count() / 1000, static_cast<long>(time->count() % 1000) * 1'000'000};
  return sigtimedwait(&set, nullptr, &limit) > 0;
}

}  // namespace

StopSignals::StopSignals() {
  const sigset_t set = stop_set();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  // When a peer goes away, write() shall return an error instead of ending the program.
  std::signal(SIGPIPE, SIG_IGN);
  watcher_ = std::jthread([this](const std::stop_token& over) { watch(over); });
}

StopSignals::~StopSignals() {
  watcher_.request_stop();
  pthread_kill(watcher_.native_handle(), SIGTERM);
}

bool StopSignals::wait_for(std::chrono::milliseconds time) const {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_for(lock, asked_.get_token(), time, [] { return false; });
  return asked_.stop_requested();
}

void StopSignals::watch(const std::stop_token& over) {
  runtime::name_this_thread("signals");
  std::optional<Clock::time_point> asked;
  // Returns whether the signal that came now is a new request, and not the last one again.
  const auto is_new_ask = [&asked] {
    const auto now = Clock::now();
    if (asked && now - *asked < kSameAsk) return false;
    asked = now;
    return true;
  };
  // Returns true when a request came or the time is over; false if nobody waits for one any more.
  const auto wait_for_ask = [&](std::optional<std::chrono::milliseconds> time) {
    const auto begin = Clock::now();
    while (!over.stop_requested()) {
      const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin);
      if (time && passed >= *time) return true;
      if (time ? comes(*time - passed) : comes({}))
        if (!over.stop_requested() && is_new_ask()) return true;
    }
    return false;
  };
  if (!wait_for_ask({})) return;
  asked_.request_stop();
  const std::chrono::milliseconds limit(end_within_ms_);
  if (!wait_for_ask(limit.count() > 0 ? std::optional(limit) : std::nullopt)) return;
  at_once_.request_stop();
  const auto begin = Clock::now();
  while (!over.stop_requested()) {
    if (comes(kLook) && is_new_ask()) break;
    const auto passed = Clock::now() - begin;
    if (passed > kForItsDuty || (passed > kToEndByItself && has_done_its_duty())) break;
  }
  if (!over.stop_requested()) leave();
}

bool StopSignals::has_done_its_duty() {
  Lock lock(mutex_);
  return duty_ == nullptr || duty_->is_done_();
}

void StopSignals::leave() {
  // The output below may block for ever if another process holds the terminal or the log. The alarm ends it then.
  alarm(2);
  Lock lock(mutex_);
  log_warning(duty_ != nullptr ? duty_->last_words_() : "ended at once: what was being written is not whole");
  _exit(kStopped);
}

StopSignals::Duty::Duty(StopSignals& signals, std::function<bool()> is_done, std::function<std::string()> last_words)
    : signals_(signals), is_done_(std::move(is_done)), last_words_(std::move(last_words)) {
  Lock lock(signals_.mutex_);
  signals_.duty_ = this;
}

StopSignals::Duty::~Duty() {
  Lock lock(signals_.mutex_);
  signals_.duty_ = nullptr;
}

}  // namespace hueline::apps
