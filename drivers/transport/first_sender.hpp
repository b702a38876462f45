#pragma once

#include "core/time.hpp"

namespace hueline::drivers {

/// A source of datagrams takes the first sender for its device. After so long a silence the device may have been
/// replaced or have got another address: the next sender counts as the first one.
constexpr nanoseconds kReplacedAfter = std::chrono::seconds(3);

}  // namespace hueline::drivers
