#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>
#include <utility>

#include "core/result.hpp"

namespace hueline::sim {

/// Owns a file descriptor and closes it.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~FileDescriptor();

  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

/// Returns the socket address of an IPv4 address in dotted form and a port. Errors: Invalid (not an address).
Result<sockaddr_in> ipv4_address(const std::string& dotted, std::uint16_t port);

/// Returns the port that the kernel gave to a bound socket; 0 if it has none.
std::uint16_t bound_port(const FileDescriptor& socket);

/// Creates an event that wakes a poll(): `wake()` raises it, `clear_wake()` resets it. Errors: Unavailable (the kernel
/// refuses).
Result<FileDescriptor> make_wake_event();
void wake(const FileDescriptor& event);
void clear_wake(const FileDescriptor& event);

}  // namespace hueline::sim
