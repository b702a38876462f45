#include "storage/file_writer.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <utility>

namespace hueline::storage {
namespace {

constexpr std::size_t kPiecesACall = 1024;  // IOV_MAX of Linux

}  // namespace

Result<FileWriter> FileWriter::create(const std::filesystem::path& path, IfExists if_exists, Disk& disk) {
  std::unique_ptr<DiskFile> file;
  if (const int result = disk.create(path, if_exists, file); result != 0)
    return output_error("create " + path.string(), -result);
  return FileWriter(path, std::move(file));
}

Result<FileWriter> FileWriter::replace(const std::filesystem::path& path, Disk& disk) {
  auto replaced = ReplacedFile::plan(path);
  if (!replaced) return replaced.error();
  if (!*replaced) return create(path, IfExists::Replace, disk);
  auto file = create((*replaced)->part(), IfExists::Replace, disk);
  if (!file) return file;
  file->replaced_ = std::move(*replaced);
  file->replaced_->begin();
  return file;
}

Status FileWriter::fail(const char* what, int errno_value) {
  const Error error =
      output_error(std::string(what) + " " + path_.string() + " at byte " + std::to_string(size_), errno_value);
  if (!error_) error_ = error;
  return *error_;
}

Status FileWriter::fail_as_cut() {
  error_ = Error{
      ErrorCode::Truncated,
      path_.string() + " was cut by another program while it was being written: what follows the cut cannot be read"};
  return *error_;
}

Status FileWriter::failed_already() const {
  if (error_) return *error_;
  if (!file_) return Error{ErrorCode::Invalid, path_.string() + " is closed: nothing more can be written"};
  return {};
}

Status FileWriter::write_by(std::int64_t (DiskFile::*append)(std::span<const iovec>),
                            std::span<const ByteView> pieces) {
  if (Status before = failed_already(); !before) return before;
  std::array<iovec, kPiecesACall> vectors;
  std::uint64_t written_in_all = 0;
  std::size_t piece = 0, offset = 0;  // where the next call continues
  while (true) {
    std::size_t count = 0;
    for (std::size_t i = piece, skip = offset; i < pieces.size() && count < vectors.size(); ++i, skip = 0)
      if (pieces[i].size() > skip)
        vectors[count++] = {const_cast<std::byte*>(pieces[i].data()) + skip, pieces[i].size() - skip};
    if (count == 0) break;
    const std::int64_t written = ((*file_).*append)(std::span(vectors).first(count));
    if (written == -EINTR) continue;
    if (written <= 0) {
      std::uint64_t missing = 0;  // of what write_behind() took
      (void)file_->settle(missing);
      size_ = std::min(size_, size_ + written_in_all - missing);
      if (written == -ENODATA) return fail_as_cut();
      // POSIX does not promise progress: do not call again for ever
      return fail("write", written == 0 ? EIO : static_cast<int>(-written));
    }
    written_in_all += static_cast<std::uint64_t>(written);
    for (std::size_t left = static_cast<std::size_t>(written); left > 0;) {
      const std::size_t step = std::min(left, pieces[piece].size() - offset);
      left -= step;
      offset += step;
      if (offset == pieces[piece].size()) ++piece, offset = 0;
    }
  }
  size_ += written_in_all;
  return {};
}

Status FileWriter::settle() {
  if (Status before = failed_already(); !before) return before;
  std::uint64_t missing = 0;
  const int result = file_->settle(missing);
  size_ -= missing;
  return result == 0 ? Status() : result == -ENODATA ? fail_as_cut() : fail("write", -result);
}

Status FileWriter::overwrite(std::uint64_t offset, ByteView bytes) {
  if (Status before = failed_already(); !before) return before;
  while (!bytes.empty()) {
    const std::int64_t written = file_->overwrite(offset, bytes);
    if (written == -EINTR) continue;
    if (written < 0) return fail("write", static_cast<int>(-written));
    if (written == 0) return fail("write", EIO);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
  return {};
}

Status FileWriter::sync() {
  if (Status before = failed_already(); !before) return before;
  // EINVAL: this kind of file cannot be synced (a pipe, a device). EROFS is an error: it reports a file system that was
  // made read-only after a fault of its medium.
  if (const int result = file_->sync(); result != 0 && result != -EINVAL) return fail("sync", -result);
  return {};
}

Status FileWriter::check_place() {
  if (Status before = failed_already(); !before) return before;
  const int result = file_->check_place();
  if (result == 0) return {};
  if (result == -ENODATA) return fail_as_cut();
  const char* what = result == -ENOENT   ? " was deleted"
                     : result == -ESTALE ? " was moved or replaced"
                                         : "'s place cannot be told";
  std::string message = path_.string() + what + " while it is being written";
  if (file_->descriptor() >= 0)
    message += "; as long as this program runs, save it: cp /proc/" + std::to_string(::getpid()) + "/fd/" +
               std::to_string(file_->descriptor()) + " SAVED.mcap";
  return Error{ErrorCode::Unavailable, message};
}

Status FileWriter::cut_back(std::uint64_t size) {
  if (!file_) return failed_already();
  int result = 0;
  do result = file_->truncate(size);
  while (result == -EINTR);
  if (result != 0) return fail("cut back", -result);
  size_ = size;
  error_.reset();
  return {};
}

Status FileWriter::close() {
  if (file_) (void)sync();  // sync() remembers its error
  return close_without_waiting();
}

void FileWriter::give_up() {
  file_.reset();
  replaced_.reset();
}

Status FileWriter::close_without_waiting() {
  if (!file_) return failed_already();
  if (const int result = file_->close(); result != 0) (void)fail("close", -result);
  file_.reset();
  if (!error_ && replaced_)
    if (const int result = replaced_->commit(); result != 0) (void)fail("rename", -result);
  replaced_.reset();
  if (error_) return *error_;
  return {};
}

}  // namespace hueline::storage
