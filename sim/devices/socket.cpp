#include "sim/devices/socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>

namespace hueline::sim {

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}

Result<sockaddr_in> ipv4_address(const std::string& dotted, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (::inet_pton(AF_INET, dotted.c_str(), &address.sin_addr) != 1) {
    return Error{ErrorCode::Invalid, fmt::format("'{}' is not an IPv4 address", dotted)};
  }
  return address;
}

std::uint16_t bound_port(const FileDescriptor& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  if (::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

Result<FileDescriptor> make_wake_event() {
  FileDescriptor event(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!event) return io_error("create an event descriptor", errno);
  return event;
}

void wake(const FileDescriptor& event) {
  const std::uint64_t one = 1;
  // a full counter means that the event is raised already
  [[maybe_unused]] const ssize_t written = ::write(event.get(), &one, sizeof(one));
}

void clear_wake(const FileDescriptor& event) {
  std::uint64_t count = 0;
  // an empty counter means that the event is reset already
  [[maybe_unused]] const ssize_t read = ::read(event.get(), &count, sizeof(count));
}

}  // namespace hueline::sim
