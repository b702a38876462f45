#include "drivers/ouster/ouster_wire.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace hueline::drivers {
namespace {

constexpr std::size_t kLegacyImuBytes = 48;

/// Returns `bytes` bytes as a number, the lowest first.
std::uint64_t number_at(const std::byte* at, std::size_t bytes) {
  std::uint64_t out = 0;
  for (std::size_t i = bytes; i-- > 0;) out = out << 8U | static_cast<std::uint64_t>(at[i]);
  return out;
}

/// Returns whether `count` columns begin at `first`, each `stride` bytes behind the one before, and follow each other.
bool are_columns(const std::byte* first, std::size_t stride, int count, int most) {
  const auto number = [&](int i) {
    return static_cast<int>(number_at(first + stride * static_cast<std::size_t>(i) + 8, 2));
  };
  if (number(0) + count > most || number(0) % count != 0) return false;
  for (int i = 1; i < count; ++i)
    if (number(i) != number(0) + i) return false;
  return true;
}

}  // namespace

std::optional<OusterOther> ouster_other(std::span<const std::byte> datagram) {
  if (datagram.size() == kLegacyImuBytes) return OusterOther::Imu;
  // The types of both headers, with a frame number behind that says nothing.
  if (datagram.size() < 64) return {};
  if (datagram[0] == std::byte{2}) return OusterOther::Imu;
  if (datagram[0] == std::byte{3}) return OusterOther::Zones;
  return {};
}

bool is_ouster_imu(std::span<const std::byte> datagram) {
  const std::byte* p = datagram.data();
  if (datagram.size() == kLegacyImuBytes) {
    constexpr std::uint64_t kSameMoment_ns = 100'000'000;
    const std::uint64_t accelerated = number_at(p + 8, 8), turned = number_at(p + 16, 8);
    const std::uint64_t apart = accelerated > turned ? accelerated - turned : turned - accelerated;
    if (accelerated == 0 || apart > kSameMoment_ns) return false;
    const auto value = [&](int i) {
      return std::bit_cast<float>(static_cast<std::uint32_t>(number_at(p + 24 + 4 * i, 4)));
    };
    constexpr float kMostG = 32, kMostDegPerS = 4000;
    bool is_possible = true, is_moving = false;
    for (int i = 0; i < 6; ++i) {
      is_possible &= std::abs(value(i)) <= (i < 3 ? kMostG : kMostDegPerS);
      is_moving |= i < 3 && std::abs(value(i)) > 0.1F;  // gravity is in one of them
    }
    return is_possible && is_moving;
  }
  if (datagram.size() < 64 || ouster_other(datagram) != OusterOther::Imu || datagram[1] != std::byte{0}) return false;
  const std::uint64_t serial = number_at(p + 7, 5);
  return serial >= 100'000'000'000 && serial < 1'000'000'000'000;  // they have twelve digits
}

OusterHeader decode_ouster_header(std::span<const std::byte> packet, const OusterMetadata& metadata) {
  const std::byte* p = packet.data();
  OusterHeader out;
  if (metadata.is_legacy()) {
    out.frame = static_cast<std::uint32_t>(number_at(p + 10, 2));
    return out;
  }
  if (metadata.is_fusa) {
    out.init_id = static_cast<std::uint32_t>(number_at(p + 1, 3));
    out.frame = static_cast<std::uint32_t>(number_at(p + 4, 4));
    out.serial = number_at(p + 11, 5);
  } else {
    out.frame = static_cast<std::uint32_t>(number_at(p + 2, 2));
    out.init_id = static_cast<std::uint32_t>(number_at(p + 4, 3));
    out.serial = number_at(p + 7, 5);
  }
  if (*out.serial == 0) out.serial.reset();
  out.shuts_down = (static_cast<unsigned>(p[18]) & 0xFU) != 0;
  out.limits_shots = (static_cast<unsigned>(p[19]) & 0xFU) != 0;
  return out;
}

OusterColumn decode_ouster_column(const std::byte* column, const OusterMetadata& metadata) {
  OusterColumn out;
  out.time_ns = number_at(column, 8);
  out.number = static_cast<int>(number_at(column + 8, 2));
  const std::byte* status = metadata.is_legacy() ? column + metadata.column_bytes() - 4 : column + 10;
  out.is_valid = (static_cast<unsigned>(*status) & 1U) != 0;
  return out;
}

bool is_ouster_packet(std::span<const std::byte> datagram, const OusterMetadata& metadata) {
  if (datagram.size() != metadata.packet_bytes()) return false;
  if (!metadata.is_legacy() && datagram[0] != std::byte{1}) return false;
  return are_columns(datagram.data() + metadata.head_bytes(), metadata.column_bytes(), metadata.columns_per_packet,
                     metadata.columns_per_frame);
}

bool looks_like_ouster(std::span<const std::byte> datagram) {
  constexpr int kColumnsInPacket = 16, kMostColumnsInFrame = 4096;
  for (const OusterProfile& profile : ouster_profiles()) {
    const bool is_legacy = &profile == ouster_profiles().data();
    for (const std::size_t channels : {16U, 32U, 64U, 128U}) {
      const std::size_t column = (is_legacy ? 20 : 12) + profile.pixel_bytes * channels, head = is_legacy ? 0 : 32;
      if (datagram.size() != 2 * head + column * kColumnsInPacket || (!is_legacy && datagram[0] != std::byte{1}))
        continue;
      if (are_columns(datagram.data() + head, column, kColumnsInPacket, kMostColumnsInFrame)) return true;
    }
  }
  return false;
}

}  // namespace hueline::drivers
