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

#include "core/bounded_queue.hpp"

/// Networks of a test's own: nothing outside is touched, and fixed ports (GigE Vision's 3956) collide with nobody's.
namespace hueline::test {

/// The calling thread, and threads it starts later, get a network namespace with nothing but a loopback interface.
/// False without the privilege (root, or unprivileged user namespaces); then everything stays as it was.
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

/// A command's success, in the caller's network.
inline bool run(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

/// Another machine: a thread in a network namespace of its own that runs what it is given.
class OtherMachine {
 public:
  OtherMachine() : thread_([this](std::stop_token stop) { work(stop); }) {}
  /// 0: no privilege.
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
