#include "drivers/sick/sick_telegram.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <system_error>

#include "core/angle.hpp"
#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {
namespace {

constexpr double kAngleUnit = 1e-4 * kRadPerDeg;
constexpr std::uint16_t kMostChannels = 64, kMostEncoders = 16;

/// Reads the values of a telegram one after the other, in either form. After the first value that is not there, all
/// others are 0 and is_whole() is false.
class Values {
 public:
  explicit Values(const SickTelegram& telegram) : rest_(telegram.values), is_text_(telegram.is_text) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return number(4); }
  std::int32_t i32() { return static_cast<std::int32_t>(number(4)); }
  double f32() { return static_cast<double>(std::bit_cast<float>(number(4))); }
  std::string characters(std::size_t count) {
    if (is_text_) return std::string(word());
    if (rest_.size() < count) return fail(), std::string();
    std::string out(reinterpret_cast<const char*>(rest_.data()), count);
    rest_ = rest_.subspan(count);
    return out;
  }
  bool is_whole() const { return is_whole_; }

 private:
  void fail() {
    is_whole_ = false;
    rest_ = {};
  }
  std::string_view word() {
    std::string_view text(reinterpret_cast<const char*>(rest_.data()), rest_.size());
    const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    rest_ = rest_.subspan(end);
    if (begin == end) fail();
    return text.substr(begin, end - begin);
  }
  std::uint32_t number(std::size_t bytes) {
    if (!is_text_) {
      if (rest_.size() < bytes) return fail(), 0;
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | std::to_integer<std::uint32_t>(rest_[i]);
      rest_ = rest_.subspan(bytes);
      return value;
    }
    std::string_view text = word();
    const bool is_decimal = text.starts_with('+') || text.starts_with('-');
    if (text.starts_with('+')) text.remove_prefix(1);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, is_decimal ? 10 : 16);
    const std::int64_t most = std::int64_t{1} << (8 * bytes);
    if (error != std::errc() || end != text.data() + text.size() || value >= most || value < -most / 2)
      return fail(), 0;
    return static_cast<std::uint32_t>(value);
  }

  std::span<const std::byte> rest_;
  bool is_text_, is_whole_ = true;
};

Error malformed(std::string_view what) { return {ErrorCode::Malformed, fmt::format("LMDscandata: {}", what)}; }

/// Returns the step of the angle from one value to the next, of which the telegram has a rounded number: it has 3333
/// where a turn has 1080 steps of 1/3 deg, which is 0.03 deg off at the end of a scan. A turn has as many steps as are
/// measured while the mirror turns once, if that is a whole number and is the same within the rounding.
double unrounded_step(std::int16_t told, double steps_a_turn) {
  const double step = told * kAngleUnit, steps = std::round(steps_a_turn);
  if (!(steps >= 1) || std::abs(steps_a_turn - steps) > 1e-3) return step;
  const double exact = 360 * kRadPerDeg / steps;
  return std::abs(std::abs(step) - exact) < kAngleUnit ? std::copysign(exact, step) : step;
}

/// Reads a channel. Returns false if it is cut or its numbers are none.
bool read_channel(Values& values, bool is_byte, double steps_a_turn, SickChannel& out) {
  out.is_byte = is_byte;
  out.name = values.characters(5);
  out.scale = values.f32();
  out.offset = values.f32();
  out.start = values.i32() * kAngleUnit;
  // The step has a sign: scanners that are mounted overhead may count downwards.
  out.step = unrounded_step(static_cast<std::int16_t>(values.u16()), steps_a_turn);
  const std::uint16_t count = values.u16();
  if (!(std::abs(out.scale) < 1e6) || !(std::abs(out.offset) < 1e9)) return false;
  for (std::uint16_t i = 0; i < count && values.is_whole(); ++i)
    out.values.push_back(is_byte ? values.u8() : values.u16());
  return values.is_whole();
}

std::optional<UnixTime> read_clock(Values& values) {
  const std::uint16_t year = values.u16();
  const std::uint8_t month = values.u8(), day = values.u8();
  const std::uint8_t hour = values.u8(), minute = values.u8(), second = values.u8();
  const std::uint32_t us = values.u32();
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!values.is_whole() || !date.ok() || hour > 23 || minute > 59 || second > 60 || us >= 1'000'000) return {};
  return UnixTime(nanoseconds(std::chrono::sys_days(date).time_since_epoch()) + std::chrono::hours(hour) +
                  std::chrono::minutes(minute) + std::chrono::seconds(second) + std::chrono::microseconds(us));
}

}  // namespace

Result<SickTelegram> read_sick_telegram(std::span<const std::byte> bytes, bool is_text) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SickTelegram out;
  out.is_text = is_text;
  if (text.size() < 3 || text[0] != 's') return Error{ErrorCode::Malformed, "a telegram without a command"};
  out.command = text.substr(0, 3);
  std::size_t at = 3;
  if (out.command != "sFA") {
    if (text.size() < 5 || text[3] != ' ') return Error{ErrorCode::Malformed, "a telegram without a name"};
    const std::size_t end = std::min(text.find(' ', 4), text.size());
    out.name = text.substr(4, end - 4);
    at = end;
  }
  if (at < text.size() && text[at] == ' ') ++at;
  out.values = bytes.subspan(at);
  return out;
}

Result<SickScan> read_sick_scan(const SickTelegram& telegram) {
  Values values(telegram);
  SickScan out;
  values.u16();  // version
  values.u16();  // device number
  out.serial = values.u32();
  const std::uint8_t status = values.u8();
  out.status = static_cast<std::uint16_t>(status << 8 | values.u8());
  out.telegrams = values.u16();
  out.scans = values.u16();
  out.since_start_us = values.u32();
  out.sent_us = values.u32();
  for (int i = 0; i < 4; ++i) values.u8();
  out.layer = static_cast<std::int16_t>(values.u16());
  out.scan_hz = values.u32() * 0.01;
  const double measured_hz = values.u32() * 100.0;
  const double steps_a_turn = out.scan_hz > 0 ? measured_hz / out.scan_hz : 0;
  const std::uint16_t encoders = values.u16();
  if (!values.is_whole()) return malformed("its head is cut");
  if (encoders > kMostEncoders) return malformed(fmt::format("{} encoders, {} are the most", encoders, kMostEncoders));
  for (std::uint16_t i = 0; i < encoders; ++i) {
    values.u32();
    values.u16();
  }
  for (const bool is_byte : {false, true}) {
    const std::uint16_t channels = values.u16();
    if (channels > kMostChannels)
      return malformed(fmt::format("{} channels, {} are the most", channels, kMostChannels));
    for (std::uint16_t i = 0; i < channels; ++i)
      if (!read_channel(values, is_byte, steps_a_turn, out.channels.emplace_back()))
        return malformed(fmt::format("channel {} ({}) is cut, or its scale is no number", i, out.channels.back().name));
  }
  if (!values.is_whole()) return malformed("its channels are cut");
  if (values.u16() == 1) {
    for (int i = 0; i < 6; ++i) values.f32();
    values.u8();
  }
  const std::uint16_t name = values.u16(), comment = values.u16();
  // The form of names and comments differs between devices; what follows them is left out.
  if (name == 0 && comment == 0 && values.u16() == 1) out.clock = read_clock(values);
  return out;
}

std::uint32_t sick_error_code(const SickTelegram& telegram) {
  Values values(telegram);
  return telegram.is_text ? values.u32() : values.u16();
}

const char* sick_error(std::uint32_t code) {
  switch (code) {
    case 1:
      return "the access is not permitted: the login failed";
    case 2:
      return "there is no such method";
    case 3:
    case 5:
      return "there is no such variable";
    case 4:
      return "the access is not permitted at this level";
    case 6:
      return "a value is out of its range";
    case 7:
      return "there is not enough data";
    default:
      return "the scanner's manual names the code";
  }
}

std::string make_cola_a(std::string_view text) {
  std::string out = "\x02";
  out += text;
  out += '\x03';
  return out;
}

std::string make_cola_b(std::string_view command_and_name, const std::vector<std::uint8_t>& values) {
  std::string telegram(command_and_name);
  if (!values.empty()) telegram += ' ';
  telegram.append(values.begin(), values.end());
  std::string out(4, '\x02');
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(telegram.size() >> shift);
  char sum = 0;
  for (const char c : telegram) sum = static_cast<char>(sum ^ c);
  return out + telegram + sum;
}

}  // namespace hueline::drivers
