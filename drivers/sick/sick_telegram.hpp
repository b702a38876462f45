#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

/// Telegrams of SICK's scanners (CoLa, cola_form.hpp): a command of three letters, a name, and values. CoLa-A writes
/// the values as text, hexadecimal or with a sign decimal, CoLa-B as big-endian numbers.
namespace hueline::drivers {

/// What a telegram says before its values.
struct SickTelegram {
  std::string_view command;  ///< "sSN": an event; "sRA", "sWA", "sAN", "sEA": answers; "sFA": an error
  std::string_view name;     ///< "LMDscandata"; empty for sFA
  std::span<const std::byte> values;
  bool is_text = false;  ///< CoLa-A
};
/// Splits the bytes between the marks of a telegram. Error: Malformed.
Result<SickTelegram> read_sick_telegram(std::span<const std::byte> bytes, bool is_text);

/// One measured quantity of a scan, such as the distances of the first echo.
struct SickChannel {
  std::string name;   ///< "DIST1" to "DIST5", "RSSI1" to "RSSI5", "ANGL1", ...
  double scale = 1;   ///< mm a step, for distances
  double offset = 0;  ///< mm
  /// Direction of the first value, and from one to the next, rad. The step is the one by which the scanner divides a
  /// turn, not rounded as in the telegram, if the frequencies of the telegram tell it.
  double start = 0, step = 0;
  bool is_byte = false;  ///< the values have 8 bits
  std::vector<std::uint16_t> values;
};

/// A scan (LMDscandata).
///
///   type            field
///   u16             version of the telegram
///   u16, u32        device number, serial number
///   u8, u8          device status: 0 0 ok, 0 1 error, 0 2 pollution warning, 0 4 pollution error
///   u16, u16        count of telegrams, count of scans
///   u32, u32        time since power-up of the scan and of the transmission, us
///   4 x u8          digital inputs and outputs
///   u16             layer angle
///   u32, u32        scan frequency, 0.01 Hz; measurement frequency, 100 Hz
///   u16             number of encoders, for each u32 position, u16 speed
///   u16             number of channels of 16 bits, for each: 5 characters, f32 scale, f32 offset, i32 first angle and
///                   u16 step, 0.0001 deg, u16 number of values, the values
///   u16             the same with 8 bits
///   u16             1: six f32 and a u8 of a position follow
///   u16, u16        1: name, comment
///   u16             1: u16 year, u8 month, day, hour, minute, second, u32 us
struct SickScan {
  std::uint32_t serial = 0;
  std::uint16_t status = 0, telegrams = 0, scans = 0;
  std::uint32_t since_start_us = 0, sent_us = 0;
  double scan_hz = 0;
  std::int16_t layer = 0;  ///< of scanners with several planes; 0 for those with one
  std::vector<SickChannel> channels;
  std::optional<UnixTime> clock;  ///< the scanner's own clock; it counts from 1970 until something sets it
};
/// Reads the values of LMDscandata. Errors: Malformed (the field that is cut or impossible).
Result<SickScan> read_sick_scan(const SickTelegram& telegram);

/// Returns what an error code of sFA means.
const char* sick_error(std::uint32_t code);
/// Returns the error code of an sFA telegram; 0 if it has none.
std::uint32_t sick_error_code(const SickTelegram& telegram);

/// Makes a telegram. `text` is the telegram in CoLa-A; CoLa-B takes the command and the name from it, and `values`.
std::string make_cola_a(std::string_view text);
std::string make_cola_b(std::string_view command_and_name, const std::vector<std::uint8_t>& values);

}  // namespace hueline::drivers
