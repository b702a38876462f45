#include "storage/disk.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

namespace hueline::storage {
namespace {

struct Free {
  void operator()(std::byte* bytes) const { std::free(bytes); }
};

/// Large appends go past the kernel's page cache (O_DIRECT): copying a camera's 300 MB/s into fresh pages of it takes
/// several times the processor time of copying them into one small buffer from which the disk fetches them. What does
/// not fill blocks goes through the page cache: the two never write parts of one block.
class KernelFile final : public DiskFile {
 public:
  KernelFile(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {
    struct stat about {};
    is_regular_ = ::fstat(fd_, &about) == 0 && S_ISREG(about.st_mode);
  }
  ~KernelFile() override {
    if (fd_ >= 0) ::close(fd_);
    if (direct_fd_ >= 0) ::close(direct_fd_);
  }

  std::int64_t append(std::span<const iovec> pieces) override {
    if (!is_regular_) return answer(::writev(fd_, pieces.data(), static_cast<int>(pieces.size())));
    std::size_t total = 0;
    for (const iovec& piece : pieces) total += piece.iov_len;
    std::int64_t taken = -EINVAL;
    if (total >= kLargeBytes && can_write_directly()) taken = append_blocks(pieces, total);
    if (taken == -EINVAL)
      taken = answer(::pwritev(fd_, pieces.data(), static_cast<int>(pieces.size()), static_cast<off_t>(end_)));
    if (taken > 0) end_ += static_cast<std::uint64_t>(taken);
    return taken;
  }
  std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
    return answer(::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset)));
  }
  int sync() override { return ::fdatasync(fd_) == 0 ? 0 : -errno; }
  int truncate(std::uint64_t size) override {
    if (::ftruncate(fd_, static_cast<off_t>(size)) != 0) return -errno;
    end_ = size;
    return 0;
  }
  int check_place() override {
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
    if (direct_fd_ >= 0) ::close(std::exchange(direct_fd_, -1));  // nothing waits in it
    // Linux frees the descriptor even if close() reports an error, so it must not be called twice.
    return ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR ? 0 : -errno;
  }

 private:
  static constexpr std::size_t kBlock = 4096;  // a multiple of the blocks of all usual disks
  static constexpr std::size_t kLargeBytes = 1U << 20;
  static constexpr std::size_t kStagedBytes = 4U << 20;

  static std::int64_t answer(ssize_t result) { return result < 0 ? -errno : result; }

  bool can_write_directly() {
    if (std::exchange(has_tried_, true)) return direct_fd_ >= 0;
    const std::string same = "/proc/self/fd/" + std::to_string(fd_);
    direct_fd_ = ::open(same.c_str(), O_WRONLY | O_DIRECT | O_CLOEXEC);  // some file systems have no such writing
    if (direct_fd_ < 0) return false;
    // The disk fetches the bytes by itself, which it can from addresses at a block only.
    staged_.reset(static_cast<std::byte*>(std::aligned_alloc(kBlock, kStagedBytes)));
    if (!staged_) ::close(std::exchange(direct_fd_, -1));
    return direct_fd_ >= 0;
  }

  /// Appends up to the next block, or as many whole blocks as fit into the buffer. Returns -EINVAL if the file cannot
  /// be written like this after all; it is then not tried again.
  std::int64_t append_blocks(std::span<const iovec> pieces, std::size_t total) {
    const std::size_t begun = static_cast<std::size_t>(end_ % kBlock);
    const bool is_direct = begun == 0;
    const std::size_t size = is_direct ? std::min(total, kStagedBytes) / kBlock * kBlock : kBlock - begun;
    std::size_t have = 0;
    for (const iovec& piece : pieces) {
      const std::size_t step = std::min(piece.iov_len, size - have);
      std::memcpy(staged_.get() + have, piece.iov_base, step);
      have += step;
      if (have == size) break;
    }
    const std::int64_t taken =
        answer(::pwrite(is_direct ? direct_fd_ : fd_, staged_.get(), size, static_cast<off_t>(end_)));
    if (taken == -EINVAL) ::close(std::exchange(direct_fd_, -1));
    return taken;
  }

  int fd_;
  const std::filesystem::path path_;
  bool is_regular_ = false;
  std::uint64_t end_ = 0;  // where the next append goes
  int direct_fd_ = -1;     // the same file without the page cache
  bool has_tried_ = false;
  std::unique_ptr<std::byte, Free> staged_;
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
    return sync_folder(path);
  }
  std::int64_t free_bytes(const std::filesystem::path& file) override {
    struct statvfs about {};
    if (::statvfs(file.c_str(), &about) != 0) return INT64_MAX;
    return static_cast<std::int64_t>(about.f_bavail) * static_cast<std::int64_t>(about.f_frsize);
  }
};

}  // namespace

int Disk::remove(const std::filesystem::path& path) { return ::unlink(path.c_str()) == 0 ? 0 : -errno; }

int Disk::link(const std::filesystem::path& target, const std::filesystem::path& path) {
  return ::symlink(target.c_str(), path.c_str()) == 0 ? sync_folder(path) : -errno;
}

Disk& Disk::kernel() {
  static KernelDisk disk;
  return disk;
}

}  // namespace hueline::storage
