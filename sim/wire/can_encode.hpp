#pragma once

#include <cstdint>
#include <span>

#include "sim/drive.hpp"
#include "sim/wire/little_endian.hpp"

/// Frames of the simulated vehicle's CAN bus, as the kernel's struct can_frame (16 bytes), and the datagram in which a
/// gateway sends them (cannelloni, version 2). Pure functions, reentrant.
namespace hueline::sim {

constexpr std::size_t kCanFrameBytes = 16;
constexpr std::uint32_t kWheelSpeedsId = 0x0B2, kWheelPulsesId = 0x1A0;

/// Volkswagen's ESP_19 (178): rear left, rear right, front left, front right in 0.0075 km/h, 16 bits each.
Bytes encode_wheel_speeds(const WheelSample& sample);
/// Bytes 0..1 and 2..3: pulses of the rear left and right wheel, most significant byte first; low half of byte 4: the
/// message's rolling counter; byte 7: SAE J1850 check sum of the others.
Bytes encode_wheel_pulses(const WheelSample& sample, std::uint32_t counter);
/// What the controller says when it goes off the bus, and when it was restarted.
Bytes encode_bus_off();
Bytes encode_bus_restarted();

/// A datagram of one frame; `sequence` counts the gateway's datagrams.
Bytes encode_cannelloni(std::span<const std::byte> frame, std::uint8_t sequence);

}  // namespace hueline::sim
