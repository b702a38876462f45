#include "core/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <iostream>
#include <string>

namespace hueline {
namespace {

/// Returns whether it is a terminal, also if its window was closed: every call to that one answers EIO.
bool is_terminal(int descriptor) { return isatty(descriptor) != 0 || errno == EIO; }

}  // namespace

void open_standard_streams() {
  // open() returns the lowest free number, so the loop ends with a number above 2. Without /dev, any other descriptor
  // keeps the number taken.
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
  // Some file systems report only at close() that the disk is full.
  if (const int copy = dup(STDOUT_FILENO); !refused && copy >= 0) refused = close(copy) != 0 && errno != EINTR;
  if (!refused && !refused_before) return {};
  const int reason = errno;
  if (is_terminal(STDOUT_FILENO)) return {};
  constexpr const char* kAttempted = "write the result to standard output";
  return reason != 0 ? io_error(kAttempted, reason)
                     : Error{ErrorCode::Io, std::string(kAttempted) + ": a part of it was refused"};
}

}  // namespace hueline
