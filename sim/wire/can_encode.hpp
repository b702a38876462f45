#pragma once

#include <cstdint>
#include <span>

#include "sim/drive.hpp"
#include "sim/wire/little_endian.hpp"

/// Frames of the simulated vehicle's CAN bus, as the kernel's struct can_frame (16 bytes), and the datagrams in which a
/// gateway sends them (cannelloni, version 2). Pure functions, reentrant.
namespace hueline::sim {

constexpr std::size_t kCanFrameBytes = 16;
constexpr std::uint32_t kWheelSpeedsId = 0x0B2, kWheelPulsesId = 0x1A0;

/// Encodes the frame 178 (Volkswagen's ESP_19): speeds of the wheels rear left, rear right, front left, front right, 16
/// bits each, in units of 0.0075 km/h.
Bytes encode_wheel_speeds(const WheelSample& sample);
/// Encodes the frame 416: the pulses of the rear wheels.
///   offset 0  u16 BE  pulses of the rear left wheel
///   offset 2  u16 BE  pulses of the rear right wheel
///   offset 4  u4      rolling counter of the message, in the low half of the byte
///   offset 7  u8      SAE J1850 check sum of the other bytes
Bytes encode_wheel_pulses(const WheelSample& sample, std::uint32_t counter);
/// Encode the error frames with which the controller reports that it went off the bus and that it was restarted.
Bytes encode_bus_off();
Bytes encode_bus_restarted();

/// Encodes a datagram with one frame; `sequence` counts the gateway's datagrams.
Bytes encode_cannelloni(std::span<const std::byte> frame, std::uint8_t sequence);

}  // namespace hueline::sim
