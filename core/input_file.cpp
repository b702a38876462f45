#include "core/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <utility>

#include "core/mutex.hpp"

namespace hueline {
namespace {

/// Counts how many times each file is open for reading. The kernel's identity of a file is the same in the whole
/// program, so this table is one for the whole program.
struct OpenInputs {
  Mutex mutex;
  std::map<std::pair<dev_t, ino_t>, int> count HUELINE_GUARDED_BY(mutex);
};
OpenInputs& open_inputs() {
  static OpenInputs inputs;
  return inputs;
}

/// A stream of a file at an address, for fopencookie().
struct RemoteStream {
  std::shared_ptr<RemoteFile> file;
  std::uint64_t at = 0;

  static ssize_t read(void* cookie, char* out, std::size_t size) {
    auto& stream = *static_cast<RemoteStream*>(cookie);
    const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(size, stream.file->size() - stream.at));
    if (!stream.file->read(stream.at, std::as_writable_bytes(std::span(out, part))).ok()) {
      errno = EIO;
      return -1;
    }
    stream.at += part;
    return static_cast<ssize_t>(part);
  }
  static int close(void* cookie) {
    delete static_cast<RemoteStream*>(cookie);
    return 0;
  }
};

const char* kind_of(mode_t mode) { return S_ISFIFO(mode) ? "a pipe" : S_ISSOCK(mode) ? "a socket" : "a device"; }

}  // namespace

bool is_open_input(const struct stat& facts) {
  OpenInputs& inputs = open_inputs();
  const Lock lock(inputs.mutex);
  return inputs.count.contains({facts.st_dev, facts.st_ino});
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  if (is_address(path)) {
    auto remote = open_remote(path);
    if (!remote.ok()) return remote.error();
    return InputFile(path, std::move(*remote));
  }
  int fd = -1;
  // Without O_NONBLOCK, open() would wait for the writer of a pipe.
  do fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  while (fd < 0 && errno == EINTR);
  if (fd < 0) return io_error("open " + path.string(), errno);
  struct stat facts {};
  const int why = ::fstat(fd, &facts) != 0 ? errno : S_ISDIR(facts.st_mode) ? EISDIR : 0;
  if (why != 0 || !S_ISREG(facts.st_mode)) {
    ::close(fd);
    if (why != 0) return io_error("open " + path.string(), why);
    return Error{ErrorCode::Unsupported, fmt::format("{} is {}, not a file: copy what it gives into a file first",
                                                     path.string(), kind_of(facts.st_mode))};
  }
  (void)::posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL);
  return InputFile(path, fd, facts);
}

InputFile::InputFile(std::filesystem::path path, int fd, const struct stat& facts)
    : path_(std::move(path)),
      fd_(fd),
      size_(static_cast<std::uint64_t>(facts.st_size)),
      device_(facts.st_dev),
      inode_(facts.st_ino) {
  OpenInputs& inputs = open_inputs();
  const Lock lock(inputs.mutex);
  ++inputs.count[{device_, inode_}];
}

InputFile::InputFile(std::filesystem::path path, std::shared_ptr<RemoteFile> remote)
    : path_(std::move(path)), remote_(std::move(remote)), size_(remote_->size()) {}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      remote_(std::move(other.remote_)),
      fd_(std::exchange(other.fd_, -1)),
      size_(other.size_),
      device_(other.device_),
      inode_(other.inode_) {}

InputFile& InputFile::operator=(InputFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(remote_, other.remote_);
  std::swap(fd_, other.fd_);
  std::swap(size_, other.size_);
  std::swap(device_, other.device_);
  std::swap(inode_, other.inode_);
  return *this;
}

InputFile::~InputFile() {
  if (fd_ < 0) return;
  {
    OpenInputs& inputs = open_inputs();
    const Lock lock(inputs.mutex);
    const auto found = inputs.count.find({device_, inode_});
    if (--found->second == 0) inputs.count.erase(found);
  }
  ::close(fd_);
}

Status InputFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  if (remote_ && (offset > size_ || out.size() > size_ - offset))
    return Error{ErrorCode::Truncated, path_.string() + " ends at byte " + std::to_string(size_)};
  if (remote_) return remote_->read(offset, out);
  while (!out.empty()) {
    const ssize_t got = ::pread(fd_, out.data(), out.size(), static_cast<off_t>(offset));
    if (got < 0) {
      if (errno == EINTR) continue;
      return io_error("read " + path_.string() + " at byte " + std::to_string(offset), errno);
    }
    if (got == 0) return Error{ErrorCode::Truncated, path_.string() + " ends at byte " + std::to_string(offset)};
    out = out.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
  return {};
}

bool InputFile::look_again() {
  struct stat facts {};
  if (fd_ < 0 || ::fstat(fd_, &facts) != 0 || static_cast<std::uint64_t>(facts.st_size) <= size_) return false;
  size_ = static_cast<std::uint64_t>(facts.st_size);
  return true;
}

Status InputFile::check_on_this_computer() const {
  if (!remote_) return {};
  return Error{ErrorCode::Unsupported,
               path_.string() + ": files of this format are not read from object storage: copy it to this computer"};
}

Result<std::FILE*> InputFile::stream() const {
  if (remote_) {
    auto cookie = std::make_unique<RemoteStream>(RemoteStream{remote_});
    cookie_io_functions_t calls{};
    calls.read = RemoteStream::read;
    calls.close = RemoteStream::close;
    std::FILE* opened = ::fopencookie(cookie.get(), "rb", calls);
    if (opened == nullptr) return io_error("open " + path_.string(), errno);
    (void)cookie.release();  // fclose() deletes it
    return opened;
  }
  const int fd = ::fcntl(fd_, F_DUPFD_CLOEXEC, 0);
  std::FILE* file = fd < 0 ? nullptr : ::fdopen(fd, "rb");
  if (file != nullptr) return file;
  const int why = errno;
  if (fd >= 0) ::close(fd);
  return io_error("open " + path_.string(), why);
}

Result<std::string> read_input(const std::filesystem::path& path, std::uint64_t most_bytes, const std::string& what) {
  const Result<InputFile> file = InputFile::open(path);
  if (!file.ok()) return file.error();
  if (file->size() > most_bytes)
    return Error{ErrorCode::Unsupported,
                 fmt::format("{} has {:.1f} MB; {} of more than {:g} MB is not read", path.string(),
                             static_cast<double>(file->size()) / 1e6, what, static_cast<double>(most_bytes) / 1e6)};
  std::string text(static_cast<std::size_t>(file->size()), '\0');
  if (Status done = file->read(0, std::as_writable_bytes(std::span(text))); !done.ok()) return done.error();
  return text;
}

}  // namespace hueline
