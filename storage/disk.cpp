#include "storage/disk.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "storage/write_behind.hpp"

namespace hueline::storage {
namespace {

/// Large appends go past the kernel's page cache (O_DIRECT): copying a camera's 300 MB/s into fresh pages of it takes
/// several times the processor time of copying them into one small buffer from which the disk fetches them. What does
/// not fill blocks goes through the page cache: the two never write parts of one block. Everything is written in order,
/// so that a killed program leaves a file that ends early and has no hole.
class KernelFile final : public DiskFile {
 public:
  KernelFile(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {
    struct stat about {};
    is_regular_ = ::fstat(fd_, &about) == 0 && S_ISREG(about.st_mode);
  }
  ~KernelFile() override {
    behind_.reset();
    if (fd_ >= 0) ::close(fd_);
    if (direct_fd_ >= 0) ::close(direct_fd_);
  }

  std::int64_t append(std::span<const iovec> pieces) override {
    if (!is_regular_) return answer(::writev(fd_, pieces.data(), static_cast<int>(pieces.size())));
    if (const int result = settle(); result != 0) return result;
    std::int64_t taken = 0;
    if (size_of(pieces) >= kLargeBytes && can_write_directly() && make_staged()) {
      const std::size_t begin = static_cast<std::size_t>(end_ % kBlock);
      const std::size_t most = begin > 0 ? kBlock - begin : kStagedBytes;
      const iovec part{staged_.bytes.get() + begin, gather(pieces, staged_.bytes.get() + begin, most)};
      taken = write_parts(end_, std::span(&part, 1));
    } else {
      taken = answer(::pwritev(fd_, pieces.data(), static_cast<int>(pieces.size()), static_cast<off_t>(end_)));
    }
    if (taken > 0) end_ += static_cast<std::uint64_t>(taken);
    return taken;
  }
  std::int64_t append_behind(std::span<const iovec> pieces) override {
    const bool is_worth_it = is_unsettled_ || size_of(pieces) >= kLargeBytes;
    if (!is_regular_ || !is_worth_it || !can_write_directly() || !make_behind()) return append(pieces);
    std::byte* const piece = behind_->free_piece();
    if (piece == nullptr) return settle();
    const std::size_t begin = static_cast<std::size_t>(end_ % kBlock);
    const std::size_t size = gather(pieces, piece + begin, kBehindBytes - begin);  // ends at a block, or with the bytes
    behind_->hand_over(end_, begin, size);
    is_unsettled_ = true;
    end_ += size;
    return static_cast<std::int64_t>(size);
  }
  bool is_settled() override { return !is_unsettled_ || behind_->is_settled(); }
  int settle(std::uint64_t& missing) override {
    missing = 0;
    if (!is_unsettled_) return 0;
    const int result = behind_->settle(missing);
    is_unsettled_ = result != 0;  // until truncate()
    return result;
  }
  std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
    if (const int result = settle(); result != 0) return result;
    return answer(::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset)));
  }
  int sync() override {
    if (const int result = settle(); result != 0) return result;
    return ::fdatasync(fd_) == 0 ? 0 : -errno;
  }
  int truncate(std::uint64_t size) override {
    if (behind_) behind_->forget();
    is_unsettled_ = false;
    if (::ftruncate(fd_, static_cast<off_t>(size)) != 0) return -errno;
    // Where it is not known to be a regular file, appends go to the descriptor's own position.
    if (!is_regular_ && ::lseek(fd_, static_cast<off_t>(size), SEEK_SET) < 0) return -errno;
    end_ = size;
    return 0;
  }
  int check_place() override {
    if (settle() != 0) return 0;  // it is not known how long the file should be
    struct stat own {
    }, there{};
    if (::fstat(fd_, &own) != 0) return -errno;
    if (!S_ISREG(own.st_mode)) return 0;
    if (own.st_nlink == 0) return -ENOENT;
    if (::stat(path_.c_str(), &there) != 0) return errno == ENOENT || errno == ENOTDIR ? -ESTALE : 0;
    if (own.st_dev != there.st_dev || own.st_ino != there.st_ino) return -ESTALE;
    return static_cast<std::uint64_t>(own.st_size) < end_ ? -ENODATA : 0;
  }
  int descriptor() const override { return fd_; }
  int close() override {
    const int settled = settle();
    behind_.reset();
    if (direct_fd_ >= 0) ::close(std::exchange(direct_fd_, -1));  // nothing waits in it
    // Linux frees the descriptor even if close() reports an error, so it must not be called twice.
    const int closed = ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR ? 0 : -errno;
    return settled != 0 ? settled : closed;
  }

 private:
  static constexpr std::size_t kBlock = BlockMemory::kBlock;
  static constexpr std::size_t kLargeBytes = 1U << 20;
  static constexpr std::size_t kStagedBytes = 4U << 20;
  /// Of a piece that is written behind: several are written at once, and what the disk has fetched is used again while
  /// the processor's cache still has it.
  static constexpr std::size_t kBehindBytes = 1U << 20;

  static std::int64_t answer(ssize_t result) { return result < 0 ? -errno : result; }
  static std::size_t size_of(std::span<const iovec> pieces) {
    std::size_t total = 0;
    for (const iovec& piece : pieces) total += piece.iov_len;
    return total;
  }
  /// Copies the first bytes, `most` of them at most, and returns their number.
  static std::size_t gather(std::span<const iovec> pieces, std::byte* to, std::size_t most) {
    std::size_t have = 0;
    for (const iovec& piece : pieces) {
      const std::size_t step = std::min(piece.iov_len, most - have);
      std::memcpy(to + have, piece.iov_base, step);
      have += step;
      if (have == most) break;
    }
    return have;
  }

  bool can_write_directly() {
    if (std::exchange(has_tried_, true)) return direct_fd_ >= 0;
    const std::string same = "/proc/self/fd/" + std::to_string(fd_);
    direct_fd_ = ::open(same.c_str(), O_WRONLY | O_DIRECT | O_CLOEXEC);  // some file systems have no such writing
    return direct_fd_ >= 0;
  }
  bool make_staged() {
    if (!staged_.bytes) staged_ = BlockMemory::of(kStagedBytes);
    return staged_.bytes != nullptr;
  }
  /// Returns false if there is no thread or no memory; it is then not tried again.
  bool make_behind() {
    if (behind_ || std::exchange(has_no_behind_, true)) return behind_ != nullptr;
    try {
      behind_ = std::make_unique<WriteBehind>(kBehindBytes, [this](std::uint64_t offset, auto parts) {
        return was_cut(offset) ? -ENODATA : write_parts(offset, parts);
      });
    } catch (const std::exception&) {
    }
    return behind_ != nullptr;
  }

  /// Returns whether the file is shorter than what was written to it: the length would not show it after the next
  /// write.
  bool was_cut(std::uint64_t written) const {
    struct stat own {};
    return ::fstat(fd_, &own) == 0 && static_cast<std::uint64_t>(own.st_size) < written;
  }

  int settle() {
    std::uint64_t missing = 0;
    return settle(missing);
  }

  /// Writes up to the next block, or the whole blocks, or what fills none. The bytes lie in their block's memory as in
  /// the file, and all parts but the last end at a block. On whichever thread writes at present.
  std::int64_t write_parts(std::uint64_t offset, std::span<const iovec> parts) {
    const iovec& first = parts.front();
    const std::size_t begun = static_cast<std::size_t>(offset % kBlock);
    const auto write = [&](int fd, std::size_t size) {
      return answer(::pwrite(fd, first.iov_base, size, static_cast<off_t>(offset)));
    };
    if (begun > 0) return write(fd_, std::min(first.iov_len, kBlock - begun));
    if (first.iov_len < kBlock || is_direct_refused_) return write(fd_, first.iov_len);
    std::array<iovec, WriteBehind::kMostAtOnce> whole;
    std::size_t count = 0;
    for (const iovec& part : parts)
      if (part.iov_len >= kBlock) whole[count++] = {part.iov_base, part.iov_len / kBlock * kBlock};
    const std::int64_t taken =
        answer(::pwritev(direct_fd_, whole.data(), static_cast<int>(count), static_cast<off_t>(offset)));
    if (taken != -EINVAL) return taken;
    is_direct_refused_ = true;  // this file cannot be written like this after all
    return write(fd_, first.iov_len);
  }

  int fd_;
  const std::filesystem::path path_;
  bool is_regular_ = false;
  std::uint64_t end_ = 0;  // where the next append goes
  int direct_fd_ = -1;     // the same file without the page cache
  bool has_tried_ = false, has_no_behind_ = false;
  bool is_unsettled_ = false;  // append_behind() took what may not be written
  std::atomic<bool> is_direct_refused_ = false;
  BlockMemory staged_;
  std::unique_ptr<WriteBehind> behind_;
};

/// Writes the folder's entry of the file to the medium, which fdatasync of the file does not promise (fsync(2)).
int sync_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return 0;  // the folder is writable, but not readable for this user, so it cannot be synced
  const int result = ::fsync(fd) == 0 || errno == EINVAL ? 0 : -errno;  // EINVAL: the folder lies on no medium
  ::close(fd);
  return result;
}

class KernelDisk final : public Disk {
 public:
  int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) override {
    int fd = -1;
    if (const int result = open_output(path, if_exists, fd); result != 0) return result;
    file = std::make_unique<KernelFile>(fd, path);
    return if_exists == IfExists::Continue ? 0 : sync_folder(path);
  }
  std::int64_t free_bytes(const std::filesystem::path& file) override {
    struct statvfs about {};
    if (::statvfs(file.c_str(), &about) != 0) return INT64_MAX;
    return static_cast<std::int64_t>(about.f_bavail) * static_cast<std::int64_t>(about.f_frsize);
  }
};

}  // namespace

int Disk::remove(const std::filesystem::path& path) { return ::unlink(path.c_str()) == 0 ? 0 : -errno; }

int Disk::sync_all(const std::filesystem::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return -errno;
  const int result = ::syncfs(fd) == 0 ? 0 : -errno;
  ::close(fd);
  return result;
}

int Disk::link(const std::filesystem::path& target, const std::filesystem::path& path) {
  return ::symlink(target.c_str(), path.c_str()) == 0 ? sync_folder(path) : -errno;
}

Disk& Disk::kernel() {
  static KernelDisk disk;
  return disk;
}

}  // namespace hueline::storage
