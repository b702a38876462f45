#pragma once

#include <filesystem>

#include "core/result.hpp"

/// Stream sockets of one computer (AF_UNIX), at paths of any length.
namespace hueline {

/// A file descriptor that is closed with this object.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept;
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  ~FileDescriptor();
  int get() const { return fd_; }
  /// Gives the descriptor away.
  int release();
  bool is_open() const { return fd_ >= 0; }

 private:
  int fd_;
};

/// Makes a socket at `path` that listens and does not block, with access for its user only. A socket that an earlier
/// run left there is replaced; any other file is not. Errors: Io; Unavailable if another file is there.
Result<FileDescriptor> listen_locally(const std::filesystem::path& path);
/// Connects to the socket at `path`, without blocking afterwards. Errors: Unavailable if nobody listens there; Io.
Result<FileDescriptor> connect_locally(const std::filesystem::path& path);

}  // namespace hueline
