#pragma once

#include <memory>

#include "config/rig.hpp"
#include "core/buffer.hpp"
#include "core/decoder.hpp"
#include "core/packet.hpp"

namespace hueline::runtime {

/// The source that the rig names for a sensor, not opened yet.
std::unique_ptr<PacketSource> make_source(const config::Sensor& sensor, const BufferPool& pool);
/// Its decoder: the same live, in replay and in inspect.
std::unique_ptr<Decoder> make_decoder(const config::Sensor& sensor);

}  // namespace hueline::runtime
