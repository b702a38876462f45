#include "storage/disk.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace hueline::storage {
namespace {

class KernelFile final : public DiskFile {
 public:
  KernelFile(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}
  ~KernelFile() override {
    if (fd_ >= 0) ::close(fd_);
  }

  std::int64_t append(std::span<const iovec> pieces) override {
    return answer(::writev(fd_, pieces.data(), static_cast<int>(pieces.size())));
  }
  std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
    return answer(::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset)));
  }
  int sync() override { return ::fdatasync(fd_) == 0 ? 0 : -errno; }
  int truncate(std::uint64_t size) override {
    if (::ftruncate(fd_, static_cast<off_t>(size)) != 0) return -errno;
    return ::lseek(fd_, static_cast<off_t>(size), SEEK_SET) < 0 ? -errno : 0;
  }
  int check_place() override {
    struct stat own {
    }, there{};
    if (::fstat(fd_, &own) != 0) return -errno;
    if (!S_ISREG(own.st_mode)) return 0;
    if (own.st_nlink == 0) return -ENOENT;
    if (::stat(path_.c_str(), &there) != 0) return errno == ENOENT || errno == ENOTDIR ? -ESTALE : 0;
    if (own.st_dev != there.st_dev || own.st_ino != there.st_ino) return -ESTALE;
    return own.st_size < ::lseek(fd_, 0, SEEK_CUR) ? -ENODATA : 0;
  }
  int descriptor() const override { return fd_; }
  int close() override {
    // Linux frees the descriptor even if close() reports an error, so it must not be called twice.
    return ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR ? 0 : -errno;
  }

 private:
  static std::int64_t answer(ssize_t result) { return result < 0 ? -errno : result; }
  int fd_;
  const std::filesystem::path path_;
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
