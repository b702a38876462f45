#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "core/remote_store.hpp"
#include "core/result.hpp"

namespace hueline {

/// A regular file that a user named to be read, or a file at an address (core/remote_store.hpp). It is read by offset
/// with pread(), so that a failing disk gives an Error and not a signal, as mmap would. While it is open, open_output()
/// (core/output_file.hpp) refuses to write over the same file under any of its names. It can be moved, but not copied.
class InputFile {
 public:
  /// Opens a file; waits for nothing but the network, if it is at an address. Errors: Io if it does not exist, is a
  /// folder or may not be read; Unsupported for a pipe, a socket or a device, whose end is not known; those of
  /// open_remote().
  static Result<InputFile> open(const std::filesystem::path& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  /// Fills `out` with the bytes from `offset` on. Errors: Truncated if the file ends before, Io if the system refuses.
  /// Thread-safe.
  Status read(std::uint64_t offset, std::span<std::byte> out) const;
  /// Returns the same file as a stream, to read it from front to back. The caller closes the stream; the protection
  /// against overwriting ends with this object. Errors: Io.
  Result<std::FILE*> stream() const;
  /// Returns the size of the file when it was opened, or when it was looked at again, in bytes.
  std::uint64_t size() const { return size_; }
  /// Looks how large the file is now, which another program may be writing. Returns whether it has grown. A file at an
  /// address keeps its size.
  bool look_again();
  const std::filesystem::path& path() const { return path_; }

  /// For what is read by libraries that open files themselves: Unsupported if the file is at an address.
  Status check_on_this_computer() const;

 private:
  InputFile(std::filesystem::path path, int fd, const struct stat& facts);
  InputFile(std::filesystem::path path, std::shared_ptr<RemoteFile> remote);
  std::filesystem::path path_;
  std::shared_ptr<RemoteFile> remote_;  // null: a file of this computer
  int fd_ = -1;
  std::uint64_t size_ = 0;
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

/// Returns whether the file of `facts` is open as an InputFile anywhere in this program. Thread-safe.
bool is_open_input(const struct stat& facts);

/// Reads a whole file. Errors: those of InputFile, and Unsupported for a file of more than `most_bytes`, which is not
/// read. `what` names the content in that message: "a configuration".
Result<std::string> read_input(const std::filesystem::path& path, std::uint64_t most_bytes, const std::string& what);

}  // namespace hueline
