#pragma once

#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <functional>
#include <future>
#include <string>
#include <thread>
#include <utility>

#include "core/bounded_queue.hpp"

/// Networks for one test: nothing outside is changed, and fixed ports (3956 of GigE Vision) do not collide.
namespace hueline::test {

/// Gives the calling thread, and the threads that it starts later, a network namespace with only a loopback interface.
/// Returns false without the privilege (root, or unprivileged user namespaces); then nothing is changed.
inline bool enter_own_network() {
  if (::unshare(CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool is_up = ::ioctl(socket, SIOCSIFFLAGS, &request) == 0;
  ::close(socket);
  return is_up;
}

/// Runs a command in the caller's network. Returns whether it succeeded.
inline bool run(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

/// Another computer: a thread in its own network namespace that runs what it is given.
class OtherMachine {
 public:
  OtherMachine() : thread_([this](std::stop_token stop) { work(stop); }) {}
  /// 0 without the privilege.
  pid_t id() { return id_.get_future().get(); }
  void run_there(std::function<void()> job) {
    std::packaged_task<void()> task(std::move(job));
    auto done = task.get_future();
    if (jobs_.try_push(std::move(task))) done.get();
  }

 private:
  void work(std::stop_token stop) {
    id_.set_value(enter_own_network() ? ::gettid() : 0);
    while (auto job = jobs_.pop(stop)) (*job)();
  }
  std::promise<pid_t> id_;
  BoundedQueue<std::packaged_task<void()>> jobs_{{.items = 8}};
  std::jthread thread_;
};

}  // namespace hueline::test
