#pragma once

#include <sys/socket.h>

namespace hueline::drivers {

/// Sets an option of a socket (setsockopt(2)). Returns false if the kernel refuses; errno says why.
template <class T>
bool set_socket_option(int fd, int level, int option, const T& value) {
  return ::setsockopt(fd, level, option, &value, sizeof(value)) == 0;
}

}  // namespace hueline::drivers
