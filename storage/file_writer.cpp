#include "storage/file_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

namespace hueline::storage {
namespace {

constexpr std::size_t kPiecesACall = 1024;  // Linux's IOV_MAX

std::string advice(int errno_value) {
  switch (errno_value) {
    case ENOSPC:
    case EDQUOT:
      return "; the disk is full: make room or record elsewhere";
    case EFBIG:
      return "; the file may not grow further here (limit of the process or the file system)";
    case EROFS:
      return "; the file system is read-only";
    case EACCES:
      return "; check the folder's permissions";
    case ENOENT:
      return "; the folder does not exist";
    case EEXIST:
      return "; recordings are never overwritten: choose another name or move it away";
    case EIO:
      return "; the medium fails: replace it and check its cable";
    default:
      return "";
  }
}

}  // namespace

Result<FileWriter> FileWriter::create(const std::filesystem::path& path, IfExists if_exists) {
  const int flags = O_WRONLY | O_CREAT | O_CLOEXEC | (if_exists == IfExists::Refuse ? O_EXCL : O_TRUNC);
  int fd = -1;
  do fd = ::open(path.c_str(), flags, 0644);
  while (fd < 0 && errno == EINTR);
  if (fd < 0) {
    const int why = errno;
    Error error = io_error("create " + path.string(), why);
    error.message += advice(why);
    return error;
  }
  return FileWriter(path, fd);
}

FileWriter::FileWriter(FileWriter&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      size_(other.size_),
      error_(std::move(other.error_)) {}

FileWriter& FileWriter::operator=(FileWriter&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(fd_, other.fd_);
  std::swap(size_, other.size_);
  std::swap(error_, other.error_);
  return *this;
}

FileWriter::~FileWriter() {
  if (fd_ >= 0) ::close(fd_);
}

Status FileWriter::fail(const char* what, int errno_value) {
  Error error = io_error(std::string(what) + " " + path_.string() + " at byte " + std::to_string(size_), errno_value);
  error.message += advice(errno_value);
  if (!error_) error_ = error;
  return *error_;
}

Status FileWriter::failed_already() const {
  if (error_) return *error_;
  if (fd_ < 0) return Error{ErrorCode::Invalid, path_.string() + " is closed: nothing more can be written"};
  return {};
}

Status FileWriter::write(std::span<const ByteView> pieces) {
  if (Status before = failed_already(); !before) return before;
  std::array<iovec, kPiecesACall> vectors;
  std::uint64_t written_in_all = 0;
  std::size_t piece = 0, offset = 0;  // where to go on
  while (true) {
    std::size_t count = 0;
    for (std::size_t i = piece, skip = offset; i < pieces.size() && count < vectors.size(); ++i, skip = 0)
      if (pieces[i].size() > skip)
        vectors[count++] = {const_cast<std::byte*>(pieces[i].data()) + skip, pieces[i].size() - skip};
    if (count == 0) break;
    const ssize_t written = ::writev(fd_, vectors.data(), static_cast<int>(count));
    if (written < 0) {
      if (errno == EINTR) continue;
      return fail("write", errno);
    }
    if (written == 0) return fail("write", EIO);  // not promised by POSIX for count > 0: do not spin on it
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

Status FileWriter::overwrite(std::uint64_t offset, ByteView bytes) {
  if (Status before = failed_already(); !before) return before;
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0) {
      if (errno == EINTR) continue;
      return fail("write", errno);
    }
    if (written == 0) return fail("write", EIO);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
  return {};
}

Status FileWriter::sync() {
  if (Status before = failed_already(); !before) return before;
  // EINVAL, EROFS: not a thing that can be synced (a pipe, a device).
  if (::fdatasync(fd_) != 0 && errno != EINVAL && errno != EROFS) return fail("sync", errno);
  return {};
}

Status FileWriter::cut_back(std::uint64_t size) {
  if (fd_ < 0) return failed_already();
  int result = 0;
  do result = ::ftruncate(fd_, static_cast<off_t>(size));
  while (result != 0 && errno == EINTR);
  if (result != 0 || ::lseek(fd_, static_cast<off_t>(size), SEEK_SET) < 0) return fail("cut back", errno);
  size_ = size;
  error_.reset();
  return {};
}

Status FileWriter::close() {
  if (fd_ < 0) return failed_already();
  (void)sync();  // remembered
  // Linux frees the descriptor even when close() reports an error: never call it twice.
  if (::close(std::exchange(fd_, -1)) != 0 && errno != EINTR) (void)fail("close", errno);
  if (error_) return *error_;
  return {};
}

}  // namespace hueline::storage
