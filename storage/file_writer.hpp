#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "core/result.hpp"
#include "storage/byte_order.hpp"
#include "storage/disk.hpp"

namespace hueline::storage {

/// A file of which every write, sync and close is checked. The first error is remembered with its errno and repeated by
/// every later call: nothing is written behind a hole. Thread-bound. Move-only.
class FileWriter {
 public:
  /// `disk` must outlive the file.
  static Result<FileWriter> create(const std::filesystem::path& path, IfExists if_exists, Disk& disk = Disk::kernel());
  FileWriter(FileWriter&&) noexcept = default;
  FileWriter& operator=(FileWriter&&) noexcept = default;
  /// Closes without a report; call close() to know.
  ~FileWriter() = default;

  /// Appends all of it; goes on after short writes and interrupts.
  Status write(ByteView bytes) { return write(std::span<const ByteView>(&bytes, 1)); }
  /// Gathers the pieces in one go (writev): payloads go from where they lie to the kernel.
  Status write(std::span<const ByteView> pieces);
  /// Overwrites bytes that were written before; the end stays the end.
  Status overwrite(std::uint64_t offset, ByteView bytes);
  /// To the medium (fdatasync). Waits for the disk.
  Status sync();
  /// Whether what was written is still what the path leads to. Unavailable: deleted, moved or replaced; writing goes
  /// on, and the message says how the bytes are reached while this program runs. Truncated: somebody has cut it;
  /// remembered, like any other error.
  Status check_place();
  /// Cuts the file back to `size` and forgets the remembered error, so that what is whole can be finished: after ENOSPC
  /// there may be room again. Error if the file cannot be cut (a device).
  Status cut_back(std::uint64_t size);
  /// Syncs and closes. Error if any of it, or anything before it, failed.
  Status close();

  /// Bytes appended, the whole calls only.
  std::uint64_t size() const { return size_; }
  const std::filesystem::path& path() const { return path_; }
  bool is_open() const { return file_ != nullptr; }

 private:
  FileWriter(std::filesystem::path path, std::unique_ptr<DiskFile> file)
      : path_(std::move(path)), file_(std::move(file)) {}
  Status fail(const char* what, int errno_value);
  Status failed_already() const;

  std::filesystem::path path_;
  std::unique_ptr<DiskFile> file_;  // null: closed
  std::uint64_t size_ = 0;
  std::optional<Error> error_;
};

}  // namespace hueline::storage
