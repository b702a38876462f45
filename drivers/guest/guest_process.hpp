#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers::guest {

/// Descriptor at which a guest finds its end of the conversation.
constexpr int kGuestSocket = 3;

/// One process of a guest program, from its start until it is reaped. It inherits the conversation's socket and nothing
/// else: standard input and output are /dev/null, what it says on standard error is kept for the text of its end.
/// Thread-bound.
class GuestProcess {
 public:
  /// Unavailable: the program is not there or cannot be run.
  static Result<GuestProcess> start(const std::filesystem::path& program);
  GuestProcess(GuestProcess&& other) noexcept
      : pid_(std::exchange(other.pid_, 0)),
        socket_(std::move(other.socket_)),
        said_(std::move(other.said_)),
        status_(other.status_) {}
  GuestProcess& operator=(GuestProcess&&) = delete;
  /// Kills it if it still runs.
  ~GuestProcess();

  int socket() const { return socket_.get(); }
  pid_t pid() const { return pid_; }
  void kill();
  /// True when it has ended and is reaped. Waits at most `limit` (a process that the kernel holds ends late, SIGKILL or
  /// not).
  bool wait(std::chrono::milliseconds limit);
  /// By itself, with status 0. After wait() said so.
  bool has_ended_well() const;
  /// How it ended, with its last words. After wait() said so.
  std::string end() const;
  /// Takes what it said on standard error so far; without this it would say no more than a pipe holds.
  void listen();

 private:
  GuestProcess(pid_t pid, FileDescriptor socket, FileDescriptor said)
      : pid_(pid), socket_(std::move(socket)), said_(std::move(said)) {}

  pid_t pid_ = 0;  // 0: reaped
  FileDescriptor socket_, said_;
  int status_ = 0;
  std::string words_;
};

/// hueline-guest beside the program that runs.
std::filesystem::path guest_program();

}  // namespace hueline::drivers::guest
