#include "apps/signals.hpp"

#include <csignal>
#include <ctime>

namespace hueline::apps {
namespace {

sigset_t stop_set() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

StopSignals::StopSignals() {
  const sigset_t set = stop_set();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  // A peer that goes away must be an error of write(), not the end of the program.
  std::signal(SIGPIPE, SIG_IGN);
  // Likewise a file that has reached the limit of its size.
  std::signal(SIGXFSZ, SIG_IGN);
}

StopSignals::~StopSignals() {
  const sigset_t set = stop_set();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

bool StopSignals::wait_for(std::chrono::milliseconds time) {
  const sigset_t set = stop_set();
  const timespec limit{time.count() / 1000, static_cast<long>(time.count() % 1000) * 1'000'000};
  return sigtimedwait(&set, nullptr, &limit) > 0;
}

}  // namespace hueline::apps
