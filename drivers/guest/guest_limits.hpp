#pragma once

#include <cstddef>

#include "core/result.hpp"

namespace hueline::drivers::guest {

/// Gives up rights for the rest of this process's life, also as root: no core files, no way to gain rights by running a
/// program, and of the rights that the process has only those that a driver uses (CAP_NET_RAW for packet sockets,
/// CAP_SYS_NICE for real-time priority). Call it before there are threads. Errors: Io.
Status give_up_rights();

/// Limits the address space to what is mapped now and `more_bytes` (RLIMIT_AS). A library that wants more is refused,
/// and most libraries then end the process. It does nothing under a sanitizer, whose shadow memory alone has terabytes.
Status limit_memory(std::size_t more_bytes);

}  // namespace hueline::drivers::guest
