#pragma once

#include <sys/uio.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "core/output_file.hpp"

/// What a FileWriter asks of the operating system, so that another disk can stand in its place: one that is full,
/// read-only, or loses its power. Answers are the kernel's: what was done, or minus errno. Nothing here retries or
/// remembers.
namespace hueline::storage {

using hueline::IfExists;

/// A file that was opened to be written. Thread-bound. Its end closes it without an answer.
class DiskFile {
 public:
  virtual ~DiskFile() = default;
  /// Appends the pieces in order (writev): bytes taken, which may be fewer than there are; -EINTR: ask again.
  virtual std::int64_t append(std::span<const iovec> pieces) = 0;
  /// Over bytes that were written before (pwrite): bytes taken; -EINTR: ask again.
  virtual std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
  /// Everything so far to the medium (fdatasync): 0, or -errno. -EINVAL: not a thing that can be synced (a pipe). After
  /// any other error nobody knows what of the data since the last good sync the medium has: Linux says it only once.
  virtual int sync() = 0;
  /// Cuts the file back; what is appended next stands there (ftruncate): 0, or -errno; -EINTR: ask again.
  virtual int truncate(std::uint64_t size) = 0;
  /// Whether the file is still where it was made, and as long as what was written: 0; -ENOENT: it was deleted; -ESTALE:
  /// its path leads to nothing or to another file; -ENODATA: somebody else has cut it. A disk that cannot tell says 0.
  virtual int check_place() { return 0; }
  /// By which other programs reach the bytes as long as this one runs, whatever became of the name; -1: none.
  virtual int descriptor() const { return -1; }
  /// 0, or -errno. Nothing but the destructor may be called afterwards.
  virtual int close() = 0;
};

/// Thread-safe.
class Disk {
 public:
  virtual ~Disk() = default;
  /// 0 and the file, or -errno (those of open_output). A file that was made is in its folder for good: a power cut does
  /// not lose its name.
  virtual int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) = 0;
  /// Bytes that may still be written beside that file; INT64_MAX: it cannot tell.
  virtual std::int64_t free_bytes(const std::filesystem::path&) { return INT64_MAX; }

  /// The operating system's own.
  static Disk& kernel();
};

}  // namespace hueline::storage
