#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers::guest {

/// File descriptor of the guest's end of the socket to the host.
constexpr int kGuestSocket = 3;

/// One process of a guest program, from its start until it is reaped. It inherits only the socket to the host. Its
/// standard input and output are /dev/null. Its standard error is kept for the text that says how it ended.
/// Thread safety: none; one thread calls all functions.
class GuestProcess {
 public:
  /// Starts the program. Error: Unavailable, if the program is missing or cannot be run.
  static Result<GuestProcess> start(const std::filesystem::path& program);
  GuestProcess(GuestProcess&& other) noexcept
      : pid_(std::exchange(other.pid_, 0)),
        socket_(std::move(other.socket_)),
        said_(std::move(other.said_)),
        status_(other.status_) {}
  GuestProcess& operator=(GuestProcess&&) = delete;
  /// Kills the process if it still runs.
  ~GuestProcess();

  int socket() const { return socket_.get(); }
  pid_t pid() const { return pid_; }
  void kill();
  /// Returns whether the process has ended and is reaped. Waits at most `limit`. (A process that the kernel holds ends
  /// late, even after SIGKILL.)
  bool wait(std::chrono::milliseconds limit);
  /// Returns whether the process ended by itself with status 0. Call it after wait() has returned true.
  bool has_ended_well() const;
  /// Says how the process ended, with its last words on standard error. Call it after wait() has returned true.
  std::string end() const;
  /// Reads what the process has written to standard error so far. Call it regularly: the process can write no more than
  /// a pipe holds until it is read.
  void listen();

 private:
  GuestProcess(pid_t pid, FileDescriptor socket, FileDescriptor said)
      : pid_(pid), socket_(std::move(socket)), said_(std::move(said)) {}

  pid_t pid_ = 0;  // 0 after it is reaped
  FileDescriptor socket_, said_;
  int status_ = 0;
  std::string words_;
};

/// Returns the path of hueline-guest, in the folder of the running program.
std::filesystem::path guest_program();

}  // namespace hueline::drivers::guest
