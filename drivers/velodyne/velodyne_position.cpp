#include "drivers/velodyne/velodyne_position.hpp"

#include <fmt/format.h>

#include <array>
#include <string>
#include <utility>

#include "drivers/velodyne/velodyne_model.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kStampAt = 198, kPpsAt = 202, kNmeaAt = 206;
constexpr std::size_t kNmeaRoom = 128;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

/// Returns the two decimal digits at `at` as a number, or -1 if they are missing.
int two_digits(std::string_view text, std::size_t at) {
  if (at + 2 > text.size()) return -1;
  const int tens = text[at] - '0', ones = text[at + 1] - '0';
  return tens < 0 || tens > 9 || ones < 0 || ones > 9 ? -1 : 10 * tens + ones;
}

/// Converts a fraction of a second: ".123" gives 123'000'000 ns, an empty text 0, and anything else -1. Digits after
/// the ninth are dropped.
std::int32_t fraction_ns(std::string_view text) {
  if (text.empty()) return 0;
  if (text[0] != '.') return -1;
  std::int32_t ns = 0, scale = 100'000'000;
  for (const char c : text.substr(1)) {
    if (c < '0' || c > '9') return -1;
    ns += (c - '0') * scale;
    scale /= 10;
  }
  return ns;
}

Error malformed_position(std::string message) { return {ErrorCode::Malformed, std::move(message)}; }

}  // namespace

Result<RmcSentence> decode_rmc(std::string_view text) {
  if (text.empty() || text[0] != '$') return malformed_position("NMEA sentence does not begin with '$'");
  const std::size_t star = text.find('*');
  if (star == std::string_view::npos || star + 3 > text.size())
    return Error{ErrorCode::Truncated, "NMEA sentence ends before its checksum"};
  int sum = 0;
  for (const char c : text.substr(1, star - 1)) sum ^= static_cast<unsigned char>(c);
  const int high = hex_digit(text[star + 1]), low = hex_digit(text[star + 2]);
  if (high < 0 || low < 0 || 16 * high + low != sum)
    return malformed_position(fmt::format("NMEA checksum is {}, computed {:02X}", text.substr(star + 1, 2), sum));

  std::array<std::string_view, 10> field;
  std::string_view rest = text.substr(1, star - 1);
  std::size_t fields = 0;
  for (bool more = true; more && fields < field.size(); ++fields) {
    const std::size_t comma = rest.find(',');
    field[fields] = rest.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
  }
  if (field[0].size() != 5 || field[0].substr(2) != "RMC")
    return Error{ErrorCode::Unsupported, fmt::format("NMEA sentence is {}, not RMC", field[0].substr(0, 8))};
  if (fields < field.size()) return malformed_position("RMC sentence has too few fields");

  const std::string_view time = field[1], date = field[9];
  RmcSentence rmc;
  rmc.is_active = field[2] == "A";
  rmc.utc.hour = two_digits(time, 0);
  rmc.utc.minute = two_digits(time, 2);
  rmc.utc.second = two_digits(time, 4);
  rmc.utc.nanosecond = time.size() >= 6 ? fraction_ns(time.substr(6)) : -1;
  rmc.utc.day = two_digits(date, 0);
  rmc.utc.month = two_digits(date, 2);
  const int year = two_digits(date, 4);
  rmc.utc.year = year < 0 ? -1 : year + (year >= 80 ? 1900 : 2000);
  // from_utc() checks the ranges, and refuses the negative numbers of missing digits.
  if (date.size() != 6 || !from_utc(rmc.utc))
    return malformed_position(fmt::format("RMC sentence has no valid time and date: '{}', '{}'", time, date));
  return rmc;
}

Result<VelodynePosition> decode_position(std::span<const std::byte> bytes) {
  if (bytes.size() != kVelodynePositionBytes)
    return malformed_position(
        fmt::format("position packet of {} bytes; {} expected", bytes.size(), kVelodynePositionBytes));
  VelodynePosition position;
  for (std::size_t i = 0; i < 4; ++i) position.hour_us |= static_cast<std::uint32_t>(bytes[kStampAt + i]) << (8 * i);
  position.hour_us %= 3'600'000'000u;  // it may count on beyond the hour
  position.pps = pulse_status(static_cast<std::uint8_t>(bytes[kPpsAt]));
  const std::string_view room(reinterpret_cast<const char*>(bytes.data()) + kNmeaAt, kNmeaRoom);
  position.nmea = room.substr(0, room.find_first_of(std::string_view("\r\n\0", 3)));
  return position;
}

std::optional<PositionSecond> second_of_latest_edge(const UtcTime& rmc, std::uint32_t hour_us) {
  UtcTime whole = rmc;
  whole.nanosecond = 0;
  const std::optional<GpsTime> named = from_utc(whole);
  if (!named) return {};
  // Both count within the UTC hour. The lag is taken modulo an hour, in [-30 min, 30 min), so it is right if an hour
  // turned between the two.
  std::int64_t lag = static_cast<std::int64_t>(hour_us / 1'000'000) - (rmc.minute * 60 + rmc.second);
  if (lag < -1800) lag += 3600;
  if (lag >= 1800) lag -= 3600;
  return PositionSecond{*named + std::chrono::seconds(lag), lag};
}

}  // namespace hueline::drivers
