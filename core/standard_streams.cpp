#include "core/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <iostream>

namespace hueline {
namespace {

/// Also a terminal whose window was closed: every call to it answers EIO.
bool is_terminal(int descriptor) { return isatty(descriptor) != 0 || errno == EIO; }

}  // namespace

void open_standard_streams() {
  // open() gives the lowest number that is free, so this ends with a number above 2. Without a /dev any descriptor
  // keeps the place.
  int descriptor = 0;
  do {
    descriptor = open("/dev/null", O_RDWR);
    if (descriptor < 0) descriptor = open("/", O_RDONLY | O_DIRECTORY);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor > STDERR_FILENO) close(descriptor);
}

Status flush_standard_output() {
  const bool refused_before = std::ferror(stdout) != 0 || !std::cout;
  errno = 0;
  std::cout.flush();
  bool refused = std::fflush(stdout) != 0 || !std::cout;
  // Some file systems say at a close() only that there is no room.
  if (const int copy = dup(STDOUT_FILENO); !refused && copy >= 0) refused = close(copy) != 0 && errno != EINTR;
  if (!refused && !refused_before) return {};
  const int reason = errno;
  if (is_terminal(STDOUT_FILENO)) return {};
  constexpr const char* kAttempted = "write the result to standard output";
  return reason != 0 ? io_error(kAttempted, reason)
                     : Error{ErrorCode::Io, std::string(kAttempted) + ": a part of it was refused"};
}

}  // namespace hueline
