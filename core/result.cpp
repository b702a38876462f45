#include "core/result.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace hueline {

const char* name(ErrorCode code) {
  constexpr std::array names{"EndOfData", "TimedOut", "Stopped",     "Disconnected", "Unavailable", "Malformed",
                             "Truncated", "Invalid",  "Unsupported", "Exhausted",    "Io"};
  const auto i = static_cast<std::size_t>(code);
  return i < names.size() ? names[i] : "?";
}

Error io_error(const std::string& attempted, int errno_value) {
  return {ErrorCode::Io, fmt::format("{}: {}", attempted, std::strerror(errno_value))};
}

void detail::end_of_wrong_result(const Error* error) {
  if (error)
    std::fprintf(stderr, "error of programming: the value of a Result was used that is the error %s: %s\n",
                 name(error->code), error->message.c_str());
  else
    std::fprintf(stderr, "error of programming: the error of a Result was used that is a value\n");
  std::abort();
}

}  // namespace hueline
