#pragma once

#include "config/section.hpp"
#include "drivers/transport/udp_source.hpp"

namespace hueline::config {

/// Keys of a mapping that names UDP ports.
drivers::UdpSource::Config read_udp(Section section);

}  // namespace hueline::config
