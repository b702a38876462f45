#pragma once

#include <array>
#include <functional>
#include <string>

#include "config/rig.hpp"
#include "core/packet.hpp"
#include "sim/drive.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::apps {

/// The packets that a flawless capture of the simulated devices would have ingested, without waiting for real time:
/// bytes of the same encoders, `received` at the moment each reaches the computer. For tests and figures; the real
/// sources are exercised by playing the same timeline on sockets. The rig gives each channel its sensor: the first of
/// the driver that fits. HostTime 0 of the drive is `host_begin`. `use` gets each packet in order; false ends. Errors:
/// Invalid (a channel without a sensor), Io (an image file).
Status for_each_simulated_packet(const sim::Drive& drive, const sim::Timeline& timeline, const config::Rig& rig,
                                 const std::function<bool(const Packet&)>& use);

/// By WireChannel: the rig's first sensor whose driver fits; kSystemSensor: none.
std::array<SensorId, sim::kWireChannels> sensors_of_channels(const config::Rig& rig);

constexpr HostTime kSimulatedHostBegin = host_time_ns(1'000'000'000'000);

}  // namespace hueline::apps
