#include "core/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <set>
#include <thread>
#include <utility>

#include "core/input_file.hpp"
#include "core/mutex.hpp"
#include "core/remote_store.hpp"
#include "core/replaced_file.hpp"

namespace hueline {
namespace {

/// The folders that this program itself holds. Its own lock does not prevent it from writing there.
struct HeldFolders {
  Mutex mutex;
  std::set<std::pair<dev_t, ino_t>> folders HUELINE_GUARDED_BY(mutex);
};
HeldFolders& held_folders() {
  static HeldFolders held;
  return held;
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

int open_folder(const std::filesystem::path& path) {
  int fd = -1;
  do fd = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  while (fd < 0 && errno == EINTR);
  return fd;
}

/// Returns whether another program holds this folder as an OutputFolder.
bool is_held_by_another(const std::filesystem::path& folder) {
  const int fd = open_folder(folder);
  if (fd < 0)
    return false;  // not readable for this user, so the lock cannot be asked; opening the file reports what is wrong
  struct stat facts {};
  bool is_held = ::flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (is_held && ::fstat(fd, &facts) == 0) {
    HeldFolders& held = held_folders();
    const Lock lock(held.mutex);
    is_held = !held.folders.contains({facts.st_dev, facts.st_ino});
  }
  ::close(fd);
  return is_held;
}

int open_once(const std::filesystem::path& path, int flags) {
  int fd = -1;
  do fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_NOCTTY | O_CLOEXEC | flags, 0644);
  while (fd < 0 && errno == EINTR);
  return fd < 0 ? -errno : fd;
}

/// Empties an existing file. Returns 0, minus errno, or 1 if the file has further names and `path` was removed from
/// them.
int empty(const std::filesystem::path& path, int fd) {
  struct stat facts {};
  if (::fstat(fd, &facts) != 0) return -errno;
  if (!S_ISREG(facts.st_mode)) return 0;
  if (is_open_input(facts)) return -EBUSY;
  if (facts.st_nlink > 1) return ::unlink(path.c_str()) == 0 || errno == ENOENT ? 1 : -errno;
  int result = 0;
  do result = ::ftruncate(fd, 0);
  while (result != 0 && errno == EINTR);
  return result == 0 ? 0 : -errno;
}

Error address_refused(const std::filesystem::path& address) {
  return {ErrorCode::Unsupported,
          address.string() +
              ": results are not written to object storage: name a file or folder of this computer, and "
              "copy what is there when it is whole"};
}

}  // namespace

int open_output(const std::filesystem::path& path, IfExists if_exists, int& fd) {
  if (is_held_by_another(folder_of(path))) return -EWOULDBLOCK;
  int opened = open_once(path, if_exists == IfExists::Refuse ? O_EXCL : 0);
  if (opened < 0) return opened;
  if (if_exists == IfExists::Replace) {
    const int result = empty(path, opened);
    if (result != 0) {
      ::close(opened);
      if (result < 0) return result;
      opened = open_once(path, O_EXCL);
      if (opened < 0) return opened;
    }
  }
  fd = opened;
  return 0;
}

Status check_output(const std::filesystem::path& path) {
  if (is_address(path)) return address_refused(path);
  const auto refused = [&](int why) { return output_error("write " + path.string(), why); };
  const std::filesystem::path folder = folder_of(path);
  if (is_held_by_another(folder)) return refused(EWOULDBLOCK);
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0) {
    if (errno != ENOENT) return refused(errno);
    return ::access(folder.c_str(), W_OK | X_OK) == 0 ? Status() : Status(refused(errno));
  }
  if (S_ISLNK(facts.st_mode)) return refused(ELOOP);
  if (S_ISDIR(facts.st_mode)) return refused(EISDIR);
  if (S_ISREG(facts.st_mode) && is_open_input(facts)) return refused(EBUSY);
  if (::access(path.c_str(), W_OK) != 0) return refused(errno);
  // The new file is made beside the older one.
  if (S_ISREG(facts.st_mode) && ::access(folder.c_str(), W_OK | X_OK) != 0) return refused(errno);
  return {};
}

Error output_error(const std::string& attempted, int errno_value) {
  // The kernel's words do not fit these.
  if (errno_value == EBUSY)
    return {ErrorCode::Io, attempted + ": refused, this command reads that file; write to another"};
  if (errno_value == EWOULDBLOCK)
    return {ErrorCode::Io, attempted +
                               ": refused, another capture, replay or the like is writing into that folder; wait for "
                               "its end, or choose another folder"};
  if (errno_value == ELOOP)
    return {ErrorCode::Io, attempted +
                               ": refused, it is a symbolic link, and outputs are not written through links; name the "
                               "file itself, or remove the link"};
  Error error = io_error(attempted, errno_value);
  switch (errno_value) {
    case ENOSPC:
    case EDQUOT:
      error.message += "; the disk is full: make room or record elsewhere";
      break;
    case EFBIG:
      error.message += "; the file may not grow further here (limit of the process or the file system)";
      break;
    case EROFS:
      error.message += "; the file system is read-only";
      break;
    case EACCES:
      error.message += "; check the folder's permissions";
      break;
    case ENOENT:
      error.message += "; the folder does not exist";
      break;
    case EEXIST:
      error.message += "; recordings are never overwritten: choose another name or move it away";
      break;
    case EIO:
      error.message += "; the medium fails: replace it and check its cable";
      break;
    default:
      break;
  }
  return error;
}

Status write_output(const std::filesystem::path& path, std::string_view text) {
  const std::string attempted = "write " + path.string();
  auto replaced = ReplacedFile::plan(path);
  if (!replaced) return replaced.error();
  int fd = -1;
  if (const int result = open_output(*replaced ? (*replaced)->part() : path, IfExists::Replace, fd); result != 0)
    return output_error(attempted, -result);
  if (*replaced) (*replaced)->begin();
  int why = 0;
  while (!text.empty() && why == 0) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written > 0)
      text.remove_prefix(static_cast<std::size_t>(written));
    else if (written == 0)
      why = EIO;  // POSIX gives 0 no meaning for count > 0; the loop must end
    else if (errno != EINTR)
      why = errno;
  }
  // Where nothing is replaced, thousands of images need not wait for the disk one by one.
  if (why == 0 && *replaced && (*replaced)->replaces_older() && ::fdatasync(fd) != 0) why = errno;
  if (::close(fd) != 0 && why == 0 && errno != EINTR) why = errno;
  if (why == 0 && *replaced) why = -(*replaced)->commit();
  return why == 0 ? Status() : Status(output_error(attempted, why));
}

Status write_output(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  return write_output(path, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

Result<OutputFolder> OutputFolder::open(const std::filesystem::path& path) {
  if (is_address(path)) return address_refused(path);
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return output_error("make folder " + path.string(), error.value());
  const int fd = open_folder(path);
  if (fd < 0) {
    // The folder is writable but not readable for this user, so it cannot be locked. If something is wrong, opening its
    // files reports it.
    if (errno == EACCES) return OutputFolder(path, -1);
    return output_error("open folder " + path.string(), errno);
  }
  // A program that opens a single file in the folder holds the lock too, for microseconds. That is no reason to refuse,
  // so the lock is tried several times.
  bool is_held = true;
  for (int asked = 0; asked < 10 && is_held; ++asked) {
    if (asked > 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    is_held = ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  }
  if (is_held) {
    ::close(fd);
    return Error{ErrorCode::Unavailable, output_error("write into " + path.string(), EWOULDBLOCK).message};
  }
  struct stat facts {};
  if (::fstat(fd, &facts) == 0) {
    HeldFolders& held = held_folders();
    const Lock lock(held.mutex);
    held.folders.insert({facts.st_dev, facts.st_ino});
  }
  return OutputFolder(path, fd);
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

OutputFolder& OutputFolder::operator=(OutputFolder&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(fd_, other.fd_);
  return *this;
}

bool OutputFolder::is_held_by_another(const std::filesystem::path& path) {
  return hueline::is_held_by_another(path.empty() ? std::filesystem::path(".") : path);
}

OutputFolder::~OutputFolder() {
  if (fd_ < 0) return;
  struct stat facts {};
  if (::fstat(fd_, &facts) == 0) {
    HeldFolders& held = held_folders();
    const Lock lock(held.mutex);
    held.folders.erase({facts.st_dev, facts.st_ino});
  }
  ::close(fd_);
}

Status check_output_folder(const std::filesystem::path& path) {
  if (is_address(path)) return address_refused(path);
  std::filesystem::path there = path.empty() ? std::filesystem::path(".") : path;
  struct stat facts {};
  while (::stat(there.c_str(), &facts) != 0) {
    if (errno != ENOENT) return output_error("make folder " + path.string(), errno);
    // The parent of "a/b/" is "a/b"; without the last slash it is "a".
    const std::filesystem::path plain = there.has_filename() ? there : there.parent_path();
    if (::lstat(plain.c_str(), &facts) == 0)
      return output_error("make folder " + path.string(), ENOENT);  // a link to nothing
    there = folder_of(plain);
  }
  if (!S_ISDIR(facts.st_mode)) return output_error("make folder " + path.string(), ENOTDIR);
  if (::access(there.c_str(), W_OK | X_OK) != 0) return output_error("write into " + there.string(), errno);
  if (is_held_by_another(there)) return output_error("write into " + there.string(), EWOULDBLOCK);
  return {};
}

}  // namespace hueline
