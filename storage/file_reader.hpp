#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "core/result.hpp"

namespace hueline::storage {

/// A file read by offset (pread: a failing disk is an Error, not a signal as with mmap). Move-only.
class FileReader {
 public:
  static Result<FileReader> open(const std::filesystem::path& path);
  FileReader(FileReader&& other) noexcept;
  FileReader& operator=(FileReader&& other) noexcept;
  ~FileReader();

  /// Fills `out` from `offset`; Truncated if the file ends before, Io if the system refuses. Const and reentrant.
  Status read(std::uint64_t offset, std::span<std::byte> out) const;
  /// Bytes in the file when it was opened.
  std::uint64_t size() const { return size_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  FileReader(std::filesystem::path path, int fd, std::uint64_t size) : path_(std::move(path)), fd_(fd), size_(size) {}
  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace hueline::storage
