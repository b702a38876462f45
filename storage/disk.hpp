#pragma once

#include <sys/uio.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "core/output_file.hpp"

/// The calls of the operating system that FileWriter uses, as an interface. A test can put another disk in the place of
/// the real one: a disk that is full, is read-only or loses its power. All functions answer as the kernel does, with
/// what was done or with minus errno. Nothing here retries or remembers an error.
namespace hueline::storage {

using hueline::IfExists;

/// A file that is open for writing. The destructor closes it and reports no error.
/// Thread safety: none; one thread calls all functions.
class DiskFile {
 public:
  virtual ~DiskFile() = default;
  /// Appends the pieces in order (writev) and returns the number of bytes taken, which may be smaller than their sum.
  /// -EINTR means: call again.
  virtual std::int64_t append(std::span<const iovec> pieces) = 0;
  /// Does what append() does, but may return before the bytes are written: they are copied. settle() tells whether they
  /// were. All other functions settle first, and what comes after bytes that could not be written is not written.
  virtual std::int64_t append_behind(std::span<const iovec> pieces) { return append(pieces); }
  /// Returns whether everything that append_behind() took is written, or could not be.
  virtual bool is_settled() { return true; }
  /// Waits until everything that append_behind() took is written. Returns 0, or minus errno until truncate() is called;
  /// -ENODATA means that another program has cut the file. `missing`: how many of the last bytes were not written.
  virtual int settle(std::uint64_t& missing) {
    missing = 0;
    return 0;
  }
  /// Overwrites bytes that were written before (pwrite) and returns the number of bytes taken. -EINTR means: call
  /// again.
  virtual std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
  /// Writes everything so far to the medium (fdatasync) and returns 0 or minus errno. -EINVAL means that this kind of
  /// file cannot be synced (a pipe). After any other error it is unknown which of the data since the last successful
  /// sync is on the medium, because Linux reports such an error only once.
  virtual int sync() = 0;
  /// Cuts the file back to `size` (ftruncate) and returns 0 or minus errno. The next append() continues there. -EINTR
  /// means: call again.
  virtual int truncate(std::uint64_t size) = 0;
  /// Checks that the file is still where it was created and as long as what was written. Returns 0 if it is; -ENOENT if
  /// it was deleted; -ESTALE if its path leads to nothing or to another file; -ENODATA if another program has cut it. A
  /// disk that cannot tell returns 0.
  virtual int check_place() { return 0; }
  /// Returns the descriptor through which other programs reach the bytes while this program runs, even if the file's
  /// name is gone; -1 if there is none.
  virtual int descriptor() const { return -1; }
  /// Closes the file and returns 0 or minus errno. Afterwards only the destructor may be called.
  virtual int close() = 0;
};

/// Creates files. Thread-safe.
class Disk {
 public:
  virtual ~Disk() = default;
  /// Creates the file and returns 0, or minus errno as open_output() does. The entry of a created file in its folder is
  /// already on the medium, so a power cut does not lose the file's name. With IfExists::Continue it does not wait for
  /// that, and the caller truncates the file to where it goes on, or to 0.
  virtual int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) = 0;
  /// Removes a file, or a symbolic link and not what it leads to. Returns 0 or minus errno.
  virtual int remove(const std::filesystem::path& path);
  /// Creates the symbolic link `path` that leads to `target`. Its entry is on the medium afterwards. Returns 0 or minus
  /// errno.
  virtual int link(const std::filesystem::path& target, const std::filesystem::path& path);
  /// Writes everything that was written to the file system of that folder to the medium (syncfs), with the names of its
  /// files. Returns 0 or minus errno. Many small files are on the medium sooner than by a sync of each.
  virtual int sync_all(const std::filesystem::path& folder);
  /// Returns the number of bytes that can still be written to the file system of that file; INT64_MAX if that is
  /// unknown.
  virtual std::int64_t free_bytes(const std::filesystem::path&) { return INT64_MAX; }

  /// Returns the disk of the operating system.
  static Disk& kernel();
};

}  // namespace hueline::storage
