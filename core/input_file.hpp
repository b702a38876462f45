#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>

#include "core/result.hpp"

namespace hueline {

/// A file that somebody named to be read, by offset (pread: a failing disk is an Error, not a signal as with mmap).
/// While it is open, nothing in this program writes over it: open_output() (core/output_file.hpp) refuses the same
/// file, by whatever name. Move-only.
class InputFile {
 public:
  /// Errors: Io (absent, a folder, no rights), Unsupported (a pipe, socket or device: nobody knows where that ends).
  /// Never waits.
  static Result<InputFile> open(const std::filesystem::path& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  /// Fills `out` from `offset`; Truncated if the file ends before, Io if the system refuses. Const and reentrant.
  Status read(std::uint64_t offset, std::span<std::byte> out) const;
  /// The same file for who reads from front to back; closed by the caller, and no longer protected than this lives. Io.
  Result<std::FILE*> stream() const;
  /// Bytes in the file when it was opened.
  std::uint64_t size() const { return size_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  InputFile(std::filesystem::path path, int fd, const struct stat& facts);
  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

/// Whether the file of `facts` is open as an InputFile somewhere in this program. Thread-safe.
bool is_open_input(const struct stat& facts);

/// A whole file of at most `most_bytes`. Errors: those of InputFile, and Unsupported for a larger one, which is not
/// read; the message says the limit. `what` names it there: "a configuration".
Result<std::string> read_input(const std::filesystem::path& path, std::uint64_t most_bytes, const std::string& what);

}  // namespace hueline
