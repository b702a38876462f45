#include "drivers/hesai/hesai_wire.hpp"

#include <fmt/format.h>

#include "core/calendar.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kFixAt = 506, kLockAt = 507;
constexpr std::size_t kOperationAt = 11;  ///< in the tail of models with high resolution: 0 if it is on
/// The fastest models turn 1200 times a minute.
constexpr unsigned kMostTurnsPerMin = 3000;

unsigned u8(std::span<const std::byte> bytes, std::size_t at) { return static_cast<unsigned>(bytes[at]); }
std::uint32_t u32(std::span<const std::byte> bytes, std::size_t at) {
  return u8(bytes, at) | u8(bytes, at + 1) << 8U | u8(bytes, at + 2) << 16U | u8(bytes, at + 3) << 24U;
}

/// Returns the number of blocks of the same firings, or 0 if the mode is not known.
int returns_of(unsigned mode) {
  switch (mode) {
    case 0x33:  // first
    case 0x34:  // second
    case 0x37:  // strongest
    case 0x38:  // last
      return 1;
    case 0x39:  // last and strongest
    case 0x3A:  // first and second
    case 0x3B:  // first and last
    case 0x3C:  // first and strongest
    case 0x3E:  // strongest and second strongest
      return 2;
    case 0x3D:  // first, last and strongest
      return 3;
    default:
      return 0;
  }
}

/// Returns the second that the date names, or nothing if there is none.
std::optional<UnixTime> second_of(std::span<const std::byte> date, bool has_short_year) {
  const unsigned year = u8(date, 0);
  // A scanner whose clock follows PTP may give seconds since 1970 in the last five bytes, the highest first.
  if (year == 0 && !has_short_year) {
    std::int64_t count = 0;
    for (std::size_t i = 1; i < 6; ++i) count = count << 8U | u8(date, i);
    // Nanoseconds of later years do not fit 64 bits; no clock of today is there.
    constexpr std::int64_t kYear2200 = 7'258'118'400;
    return count > 0 && count < kYear2200 ? std::optional(UnixTime(std::chrono::seconds(count))) : std::nullopt;
  }
  UtcTime utc;
  utc.year = static_cast<int>(year) + (has_short_year && year < 100 ? 2000 : 1900);
  utc.month = static_cast<int>(u8(date, 1));
  utc.day = static_cast<int>(u8(date, 2));
  utc.hour = static_cast<int>(u8(date, 3));
  utc.minute = static_cast<int>(u8(date, 4));
  utc.second = static_cast<int>(u8(date, 5));
  const auto time = from_utc(utc);
  return time ? std::optional(to_unix(*time)) : std::nullopt;
}

}  // namespace

bool has_hesai_header(std::span<const std::byte> datagram) {
  return datagram.size() > 200 && u8(datagram, 0) == 0xEE && u8(datagram, 1) == 0xFF;
}

std::optional<HesaiModel> hesai_model(std::span<const std::byte> datagram) {
  for (const HesaiTable& table : hesai_tables()) {
    if (datagram.size() < table.least_bytes()) continue;
    if (table.head == 0) {
      // No header: all blocks have their flag, and the size is the model's.
      if (datagram.size() != table.least_bytes() && datagram.size() != table.least_bytes() + 4) continue;
      bool has_flags = true;
      for (std::size_t b = 0; b < static_cast<std::size_t>(table.blocks); ++b)
        has_flags &= u8(datagram, b * table.block_bytes()) == 0xFF && u8(datagram, b * table.block_bytes() + 1) == 0xEE;
      if (has_flags) return table.model;
      continue;
    }
    const std::size_t counts_at = table.head == 8 ? 2 : 6;
    // An AT128 has the counts of a QT128; the versions of its protocol are 4.1 and 4.3.
    if (table.head == 12 && u8(datagram, 2) == 4) continue;
    if (has_hesai_header(datagram) && u8(datagram, counts_at) == static_cast<unsigned>(table.channels()) &&
        u8(datagram, counts_at + 1) == static_cast<unsigned>(table.blocks) &&
        (table.head != 12 || (u8(datagram, 4) >= table.least_status && u8(datagram, 4) <= table.most_status)) &&
        datagram.size() < table.least_bytes() + 64)
      return table.model;
  }
  return {};
}

Result<HesaiPacket> decode_hesai(std::span<const std::byte> datagram, const HesaiTable& table) {
  if (datagram.size() < table.least_bytes())
    return Error{ErrorCode::Truncated, fmt::format("{}: data packet of {} bytes; it has at least {}", table.name,
                                                   datagram.size(), table.least_bytes())};
  const auto tail = datagram.subspan(table.tail_at());
  HesaiPacket packet;
  packet.mode = static_cast<std::uint8_t>(u8(tail, table.tail.mode));
  packet.returns = returns_of(packet.mode);
  if (packet.returns == 0 || table.blocks % packet.returns != 0)
    return Error{ErrorCode::Unsupported, fmt::format("{}: return mode 0x{:02X} is not known", table.name, packet.mode)};
  const unsigned step_mm = table.head == 0 ? 4 : u8(datagram, table.head == 8 ? 5 : 9);
  if (step_mm == 0 || step_mm > 20)
    return Error{ErrorCode::Malformed, fmt::format("{}: step of the distance {} mm", table.name, step_mm)};
  packet.range_step_m = step_mm * 1e-3;
  const unsigned turns = u8(tail, table.tail.speed) | u8(tail, table.tail.speed + 1) << 8U;
  if (turns > kMostTurnsPerMin)
    return Error{ErrorCode::Malformed, fmt::format("{}: a motor that turns {} times a minute", table.name, turns)};
  packet.turns_per_min = turns;
  const std::uint32_t us = u32(tail, table.tail.microseconds);
  if (us > 1'000'000)
    return Error{ErrorCode::Malformed, fmt::format("{}: {} us are beyond the second", table.name, us)};
  packet.time = second_of(tail.subspan(table.tail.date, 6), table.has_short_year);
  if (packet.time) *packet.time += std::chrono::microseconds(us);
  if (tail.size() >= table.tail.sequence + 4) packet.sequence = u32(tail, table.tail.sequence);
  packet.is_fine = table.fine_period != 0 && u8(tail, kOperationAt) == 0;
  packet.is_second = !table.times_of_second.empty() && (u8(tail, 5) & 1U) == 0;
  return packet;
}

std::optional<HesaiGps> decode_hesai_gps(std::span<const std::byte> datagram) {
  if (datagram.size() != kHesaiGpsBytes || u8(datagram, 0) != 0xFF || u8(datagram, 1) != 0xEE) return {};
  HesaiGps gps;
  gps.has_fix = u8(datagram, kFixAt) == 'A';
  gps.is_locked = u8(datagram, kLockAt) == 1;
  return gps;
}

}  // namespace hueline::drivers
