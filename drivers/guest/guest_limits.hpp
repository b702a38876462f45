#pragma once

#include <cstddef>

#include "core/result.hpp"

namespace hueline::drivers::guest {

/// For the rest of this process's life: no core files, no way to gain rights by running a program, and of those it has
/// only what a driver uses (CAP_NET_RAW: packet sockets; CAP_SYS_NICE: real-time priority), root or not. To be called
/// before there are threads. Io.
Status give_up_rights();

/// Address space for what is mapped now and so much more (RLIMIT_AS). A library that wants more is refused, and most
/// end themselves then. Nothing under a sanitizer, whose shadow alone is terabytes.
Status limit_memory(std::size_t more_bytes);

}  // namespace hueline::drivers::guest
