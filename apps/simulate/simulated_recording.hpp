#pragma once

#include <array>
#include <functional>
#include <string>

#include "config/rig.hpp"
#include "core/packet.hpp"
#include "sim/drive.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::apps {

/// Calls `use` with the packets that a flawless capture of the simulated devices would have received, in order, until
/// `use` returns false. It does not wait for real time. The bytes come from the same encoders as those of the emulated
/// devices, and `received` is the moment at which a packet reaches the computer. Drive time 0 is kSimulatedHostBegin.
/// The rig gives each channel its sensor, the first one whose driver fits.
/// This function is for tests and figures. The real sources are tested by playing the same timeline on sockets.
/// Errors: Invalid (a channel without a sensor), Io (an image file).
Status for_each_simulated_packet(const sim::Drive& drive, const sim::Timeline& timeline, const config::Rig& rig,
                                 const std::function<bool(const Packet&)>& use);

/// Returns for each WireChannel the rig's first sensor whose driver fits, or kSystemSensor if there is none.
std::array<SensorId, sim::kWireChannels> sensors_of_channels(const config::Rig& rig);

/// Arrival time at which a simulated drive begins.
constexpr HostTime kSimulatedHostBegin = host_time_ns(1'000'000'000'000);

}  // namespace hueline::apps
