#pragma once

#include <cstddef>

namespace hueline::drivers {

/// How much room a kernel needs behind the returns of a packet, in returns: those of a vector are written before it is
/// known how many of them are kept, and those of the next one over the ones that are not (write_returns-inl.hpp).
constexpr std::size_t kWrittenAhead = 16;

}  // namespace hueline::drivers
