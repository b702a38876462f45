#include "drivers/livox/livox_wire.hpp"

#include <chrono>
#include <cstring>

namespace hueline::drivers {
namespace {

constexpr std::size_t kFirstHeader = 18, kSecondHeader = 36;
constexpr std::uint8_t kFirstVersion = 5, kSecondVersion = 0;
/// 100 years: no stamp is larger.
constexpr std::uint64_t kLongestNs = 3'153'600'000'000'000'000;

constexpr LivoxForm kForms[] = {
    {"Cartesian", 1, 0, 100, 13, 1, false, false, false},
    {"spherical", 1, 1, 100, 9, 1, true, false, false},
    {"Cartesian with tag", 1, 2, 96, 14, 1, false, true, false},
    {"spherical with tag", 1, 3, 96, 10, 1, true, true, false},
    {"Cartesian dual", 1, 4, 48, 28, 2, false, true, false},
    {"spherical dual", 1, 5, 48, 16, 2, true, true, false},
    {"IMU", 1, 6, 1, 24, 0, false, false, false},
    {"Cartesian triple", 1, 7, 30, 42, 3, false, true, false},
    {"spherical triple", 1, 8, 30, 22, 3, true, true, false},
    {"IMU", 2, 0x00, 0, 24, 0, false, false, false},
    {"Cartesian", 2, 0x01, 0, 14, 1, false, true, false},
    {"Cartesian short", 2, 0x02, 0, 8, 1, false, true, true},
    {"spherical", 2, 0x03, 0, 10, 1, true, true, false},
    {"Cartesian dual", 2, 0x11, 0, 28, 2, false, true, false},
};

template <class T>
T number_in(const std::byte* p) {
  T value;
  std::memcpy(&value, p, sizeof(T));  // the program runs on little-endian computers only (novatel/wire.hpp)
  return value;
}

const LivoxForm* form_of(std::uint8_t generation, std::uint8_t number) {
  for (const LivoxForm& form : kForms)
    if (form.generation == generation && form.number == number) return &form;
  return nullptr;
}

std::optional<std::int64_t> nanoseconds_of(std::uint64_t value) {
  if (value >= kLongestNs) return {};
  return static_cast<std::int64_t>(value);
}

/// A date of the first generation: year since 2000, month, day, hour, and microseconds of the hour.
std::optional<std::int64_t> date_ns(const std::byte* p) {
  using namespace std::chrono;
  const auto byte = [&](int i) { return static_cast<unsigned>(p[i]); };
  const year_month_day date{year(2000 + static_cast<int>(byte(0))), month(byte(1)), day(byte(2))};
  const auto microsecond = number_in<std::uint32_t>(p + 4);
  if (!date.ok() || byte(3) > 23 || microsecond >= 3'600'000'000u) return {};
  return nanoseconds(sys_days(date).time_since_epoch() + hours(byte(3)) + microseconds(microsecond)).count();
}

std::optional<LivoxPacket> first_generation(std::span<const std::byte> bytes) {
  if (bytes.size() < kFirstHeader || bytes[0] != std::byte{kFirstVersion}) return {};
  LivoxPacket out;
  out.form = form_of(1, static_cast<std::uint8_t>(bytes[9]));
  if (!out.form || bytes.size() != kFirstHeader + std::size_t{out.form->points} * out.form->point_bytes) return {};
  out.points = out.form->points;
  out.data = bytes.subspan(kFirstHeader);
  out.scanner = static_cast<std::uint16_t>(static_cast<unsigned>(bytes[1]) << 8 | static_cast<unsigned>(bytes[2]));
  out.is_clock_abnormal = (number_in<std::uint32_t>(bytes.data() + 4) >> 14 & 7) == 4;
  const auto plain = nanoseconds_of(number_in<std::uint64_t>(bytes.data() + 10));
  switch (static_cast<std::uint8_t>(bytes[8])) {
    case 0:
      out.time_kind = LivoxTimeKind::Own;
      out.time_ns = plain;
      break;
    case 1:
      out.time_kind = LivoxTimeKind::Ptp;
      out.time_ns = plain;
      break;
    case 3:
      out.time_kind = LivoxTimeKind::Utc;
      out.time_ns = date_ns(bytes.data() + 10);
      break;
    case 4:
      out.time_kind = LivoxTimeKind::Pulse;
      out.time_ns = plain;
      break;
    default:
      break;
  }
  return out;
}

std::optional<LivoxPacket> second_generation(std::span<const std::byte> bytes) {
  if (bytes.size() <= kSecondHeader || bytes[0] != std::byte{kSecondVersion} ||
      number_in<std::uint16_t>(bytes.data() + 1) != bytes.size())
    return {};
  LivoxPacket out;
  out.form = form_of(2, static_cast<std::uint8_t>(bytes[10]));
  out.points = number_in<std::uint16_t>(bytes.data() + 5);
  if (!out.form || bytes.size() != kSecondHeader + out.points * out.form->point_bytes) return {};
  out.data = bytes.subspan(kSecondHeader);
  out.span_ns = std::int64_t{100} * number_in<std::uint16_t>(bytes.data() + 3);
  out.sequence = number_in<std::uint16_t>(bytes.data() + 7);
  out.time_ns = nanoseconds_of(number_in<std::uint64_t>(bytes.data() + 28));
  const auto kind = static_cast<std::uint8_t>(bytes[11]);
  out.time_kind = kind == 0   ? LivoxTimeKind::Own
                  : kind == 1 ? LivoxTimeKind::Ptp
                  : kind == 2 ? LivoxTimeKind::Utc
                              : LivoxTimeKind::Unknown;
  return out;
}

}  // namespace

std::optional<LivoxPacket> decode_livox(std::span<const std::byte> bytes) {
  if (auto first = first_generation(bytes)) return first;
  return second_generation(bytes);
}

}  // namespace hueline::drivers
