#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <utility>

#include "core/result.hpp"

namespace hueline {

/// A file without a name that holds what memory has no room for, until the program ends or the object is destroyed: the
/// system frees its space in any case. It can be moved, but not copied. Thread safety: none.
class ScratchFile {
 public:
  /// Makes the file on the file system of a folder. Errors: Io.
  static Result<ScratchFile> create(const std::filesystem::path& folder);
  ScratchFile(ScratchFile&& other) noexcept;
  ScratchFile& operator=(ScratchFile&& other) noexcept;
  ~ScratchFile();

  /// Appends the bytes and returns where they begin. Errors: Io, with what to do.
  Result<std::uint64_t> append(std::span<const std::byte> bytes);
  /// Fills `out` with the bytes from `offset` on. Errors: Io; Truncated.
  Status read(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  ScratchFile(std::filesystem::path folder, int fd) : folder_(std::move(folder)), fd_(fd) {}
  std::filesystem::path folder_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace hueline
