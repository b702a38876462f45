#include "core/local_socket.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace hueline {
namespace {

/// A socket, and an address that stands for its path. An address holds 107 bytes, so longer paths are named through
/// the open folder.
struct Named {
  FileDescriptor folder, socket;
  sockaddr_un address{};
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&address); }
};

Result<Named> name_socket(const std::filesystem::path& path) {
  Named out;
  out.socket = FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!out.socket.is_open()) return io_error("a local socket cannot be made", errno);
  std::string name = path.string();
  if (name.size() >= sizeof(out.address.sun_path)) {
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    out.folder = FileDescriptor(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!out.folder.is_open()) return io_error(folder.string() + " cannot be opened", errno);
    name = fmt::format("/proc/self/fd/{}/{}", out.folder.get(), path.filename().string());
  }
  if (name.size() >= sizeof(out.address.sun_path))
    return Error{ErrorCode::Invalid, path.string() + ": the name of the socket is too long"};
  out.address.sun_family = AF_UNIX;
  std::memcpy(out.address.sun_path, name.c_str(), name.size() + 1);
  return out;
}

}  // namespace

FileDescriptor::FileDescriptor(FileDescriptor&& other) noexcept : fd_(other.release()) {}
FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = other.release();
  }
  return *this;
}
FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}
int FileDescriptor::release() { return std::exchange(fd_, -1); }

Result<FileDescriptor> listen_locally(const std::filesystem::path& path) {
  auto named = name_socket(path);
  if (!named.ok()) return named.error();
  struct stat there {};
  if (::lstat(path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode))
      return Error{ErrorCode::Unavailable, path.string() + " exists and is no socket: move it away"};
    if (::unlink(path.c_str()) != 0) return io_error(path.string() + " cannot be replaced", errno);
  }
  // The mode of a socket that has no name yet becomes that of its file.
  if (::fchmod(named->socket.get(), 0600) != 0 ||
      ::bind(named->socket.get(), named->get(), sizeof named->address) != 0 || ::listen(named->socket.get(), 8) != 0)
    return io_error(path.string() + ": the socket cannot be made", errno);
  return std::move(named->socket);
}

Result<FileDescriptor> connect_locally(const std::filesystem::path& path) {
  auto named = name_socket(path);
  if (!named.ok()) return named.error();
  if (::connect(named->socket.get(), named->get(), sizeof named->address) != 0) {
    if (errno == ECONNREFUSED || errno == ENOENT || errno == EAGAIN)
      return Error{ErrorCode::Unavailable, path.string() + ": nobody listens there"};
    return io_error(path.string() + ": no connection", errno);
  }
  return std::move(named->socket);
}

}  // namespace hueline
