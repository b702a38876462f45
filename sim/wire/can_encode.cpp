#include "sim/wire/can_encode.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hueline::sim {
namespace {

using Data = std::array<std::uint8_t, 8>;

Bytes frame_of(std::uint32_t id, const Data& data) {
  LittleEndianWriter out(kCanFrameBytes);
  out.put(id);
  out.put(std::uint8_t{8});
  out.put_zeros(3);
  for (const std::uint8_t byte : data) out.put(byte);
  return out.take();
}

/// Computes the check sum bit by bit, as the standard draws its shift register.
std::uint8_t j1850(std::span<const std::uint8_t> data) {
  unsigned shift = 0xFF;
  for (const std::uint8_t byte : data)
    for (int bit = 7; bit >= 0; --bit) {
      const unsigned feedback = (shift >> 7 ^ static_cast<unsigned>(byte) >> bit) & 1U;
      shift = (shift << 1 & 0xFFU) ^ (feedback ? 0x1DU : 0U);
    }
  return static_cast<std::uint8_t>(~shift);
}

constexpr std::uint32_t kErrorFrame = 0x20000000, kBusOff = 0x40, kRestarted = 0x100;

}  // namespace

Bytes encode_wheel_speeds(const WheelSample& sample) {
  constexpr double kUnit = 0.0075 / 3.6;
  constexpr std::array<std::size_t, 4> kOrder{2, 3, 0, 1};
  Data data{};
  for (std::size_t i = 0; i < 4; ++i) {
    const long raw = std::clamp(std::lround(sample.speed[kOrder[i]] / kUnit), 0L, 65532L);
    data[2 * i] = static_cast<std::uint8_t>(raw & 0xFF);
    data[2 * i + 1] = static_cast<std::uint8_t>(raw >> 8);
  }
  return frame_of(kWheelSpeedsId, data);
}

Bytes encode_wheel_pulses(const WheelSample& sample, std::uint32_t counter) {
  Data data{};
  for (std::size_t side = 0; side < 2; ++side) {
    data[2 * side] = static_cast<std::uint8_t>(sample.pulses[side] >> 8);
    data[2 * side + 1] = static_cast<std::uint8_t>(sample.pulses[side]);
  }
  data[4] = static_cast<std::uint8_t>(counter & 0x0F);
  data[7] = j1850(std::span(data).first(7));
  return frame_of(kWheelPulsesId, data);
}

Bytes encode_bus_off() { return frame_of(kErrorFrame | kBusOff, {}); }
Bytes encode_bus_restarted() { return frame_of(kErrorFrame | kRestarted, {}); }

Bytes encode_cannelloni(std::span<const std::byte> frame, std::uint8_t sequence) {
  Bytes out;
  for (const int head : {2, 0, static_cast<int>(sequence), 0, 1}) out.push_back(static_cast<std::byte>(head));
  for (std::size_t i = 0; i < 4; ++i) out.push_back(frame[3 - i]);
  out.push_back(frame[4]);
  out.insert(out.end(), frame.begin() + 8, frame.begin() + 8 + std::to_integer<int>(frame[4]));
  return out;
}

}  // namespace hueline::sim
