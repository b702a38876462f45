#pragma once

#include <sys/ioctl.h>

#include <cerrno>

namespace hueline::drivers {

/// ioctl() that a signal does not end. Returns its result; errno says why it failed.
inline int v4l2_ioctl(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result != 0 && errno == EINTR);
  return result;
}

}  // namespace hueline::drivers
