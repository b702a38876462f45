#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "core/replaced_file.hpp"
#include "core/result.hpp"
#include "storage/byte_order.hpp"
#include "storage/disk.hpp"

namespace hueline::storage {

/// A file of which every write, sync and close is checked. It remembers the first error with its errno, and every later
/// call returns that error: nothing is written behind a gap. Move-only.
/// Thread safety: none; one thread calls all functions.
class FileWriter {
 public:
  /// Creates the file. `disk` must outlive it.
  static Result<FileWriter> create(const std::filesystem::path& path, IfExists if_exists, Disk& disk = Disk::kernel());
  /// Creates a file that takes the place of `path` when close() succeeds: what stands there stays until then, and for
  /// ever if this file is not finished. Until then its name ends with ".part". What is no file, such as a pipe or a
  /// device, is opened as it is. Errors: as create() with Replace.
  static Result<FileWriter> replace(const std::filesystem::path& path, Disk& disk = Disk::kernel());
  FileWriter(FileWriter&&) noexcept = default;
  FileWriter& operator=(FileWriter&&) noexcept = default;
  /// Closes the file without reporting an error. Call close() to learn about errors.
  ~FileWriter() = default;

  /// Appends all bytes. It continues after short writes and interrupts.
  Status write(ByteView bytes) { return write(std::span<const ByteView>(&bytes, 1)); }
  /// Appends the pieces with as few system calls as possible (writev), without copying them first.
  Status write(std::span<const ByteView> pieces) { return write_by(&DiskFile::append, pieces); }
  /// Does what write() does, but may return before the disk has the bytes, which are copied. settle() tells whether it
  /// got them.
  Status write_behind(std::span<const ByteView> pieces) { return write_by(&DiskFile::append_behind, pieces); }
  /// Returns whether the disk has what write_behind() took, or refused it.
  bool is_settled() const { return !file_ || file_->is_settled(); }
  /// Waits until the disk has what write_behind() took. If this or write_behind() fails, size() is what the disk has.
  /// Errors: as write(), and Truncated as check_place().
  Status settle();
  /// Overwrites bytes that were written before. The end of the file stays where it is.
  Status overwrite(std::uint64_t offset, ByteView bytes);
  /// Writes everything so far to the medium (fdatasync) and waits for the disk.
  Status sync();
  /// Checks that the path still leads to the bytes that were written. Errors: Unavailable if the file was deleted,
  /// moved or replaced; writing continues, and the message says how the bytes can be reached while this program runs.
  /// Truncated if another program has cut the file; this error is remembered like any other.
  Status check_place();
  /// Cuts the file back to `size` and forgets the remembered error, so that the whole part can be finished: after
  /// ENOSPC there may be room again. Returns an error if the file cannot be cut (a device).
  Status cut_back(std::uint64_t size);
  /// Closes a file that is not to be finished. What a file of replace() would have replaced stays. Later calls return
  /// Invalid.
  void give_up();
  /// Closes without waiting for the medium: Disk::sync_all() does that for many files at once. Errors: as close().
  Status close_without_waiting();
  /// Syncs and closes. Returns an error if any part of this, or anything before it, failed.
  Status close();

  /// Bytes of all write() and write_behind() calls that succeeded completely.
  std::uint64_t size() const { return size_; }
  const std::filesystem::path& path() const { return path_; }
  bool is_open() const { return file_ != nullptr; }

 private:
  FileWriter(std::filesystem::path path, std::unique_ptr<DiskFile> file)
      : path_(std::move(path)), file_(std::move(file)) {}
  Status write_by(std::int64_t (DiskFile::*append)(std::span<const iovec>), std::span<const ByteView> pieces);
  Status fail(const char* what, int errno_value);
  Status fail_as_cut();
  Status failed_already() const;

  std::filesystem::path path_;
  std::unique_ptr<DiskFile> file_;        // null when closed
  std::optional<ReplacedFile> replaced_;  // of replace()
  std::uint64_t size_ = 0;
  std::optional<Error> error_;
};

}  // namespace hueline::storage
