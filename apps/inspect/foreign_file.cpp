#include "apps/inspect/foreign_file.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/line_words.hpp"
#include "core/number_word.hpp"
#include "storage/image_file.hpp"

namespace hueline::apps {
namespace {

std::uint8_t byte_at(std::string_view bytes, std::size_t at) { return static_cast<std::uint8_t>(bytes[at]); }

bool is_rtklib_solution(std::string_view first) {
  constexpr std::array<std::string_view, 4> kHeads = {"% program   : ", "%  GPST ", "%  UTC ", "%  JST "};
  return std::ranges::any_of(kHeads, [&](std::string_view head) { return first.starts_with(head); });
}

bool is_rinex(std::string_view first) {
  const std::string_view line = first.substr(0, first.find('\n'));
  return line.size() > 60 && line.substr(60).starts_with("RINEX VERSION");
}

/// Returns whether a line is the head of a log: <BESTPOS COM1 0 65.0 FINESTEERING 1687 419192.035 00000000 3681 3153
bool is_abbreviated_head(std::string_view line) {
  if (!line.starts_with('<') || line.size() < 2 || line[1] < 'A' || line[1] > 'Z') return false;
  constexpr std::size_t kWeek = 5, kWords = 10;
  const auto words = line_words(line, " \r");
  return words.size() >= kWords && words[kWeek].find_first_not_of("0123456789") == std::string_view::npos;
}

/// One head that is whole, also behind a receiver's prompt: <OK, [COM1].
bool has_abbreviated_log(std::string_view first) {
  while (!first.empty()) {
    const std::string_view line = first.substr(0, first.find('\n'));
    if (is_abbreviated_head(line)) return true;
    first.remove_prefix(std::min(line.size() + 1, first.size()));
  }
  return false;
}

/// A message of an OEM3: AA 44 11, the exclusive or of all its bytes but this one, u32 id, u32 size with this header.
bool has_oem3_message(std::string_view first) {
  constexpr std::size_t kHeader = 12, kMost = 4096;
  for (std::size_t at = first.find("\xAA\x44\x11"); at != std::string_view::npos && at + kHeader <= first.size();
       at = first.find("\xAA\x44\x11", at + 1)) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size |= static_cast<std::size_t>(byte_at(first, at + 8 + i)) << (8 * i);
    if (size < kHeader || size > kMost || at + size > first.size()) continue;
    std::uint8_t sum = 0;
    for (std::size_t i = 0; i < size; ++i)
      if (i != 3) sum = static_cast<std::uint8_t>(sum ^ byte_at(first, at + i));
    if (sum == byte_at(first, at + 3)) return true;
  }
  return false;
}

/// Two messages of RTCM 3 one behind the other: D3, six zero bits, ten bits of length, content, a check sum of 3 bytes.
bool is_rtcm3(std::string_view first) {
  std::size_t at = 0;
  for (int messages = 0; messages < 2; ++messages) {
    if (first.size() < at + 3 || byte_at(first, at) != 0xD3 || (byte_at(first, at + 1) & 0xFC) != 0) return false;
    at += 6 + ((static_cast<std::size_t>(byte_at(first, at + 1)) & 3) << 8 | byte_at(first, at + 2));
  }
  return true;
}

/// A grid of Esri's, in ASCII: a line "ncols 4" in front, in small letters or capitals.
bool is_ascii_grid(std::string_view first) {
  const auto words = line_words(first.substr(0, first.find('\n')), " \t\r");
  constexpr std::string_view kKey = "ncols";
  const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return words.size() == 2 && std::ranges::equal(words[0], kKey, {}, small) && parse_number<unsigned>(words[1]);
}

bool is_tiff(std::string_view first) {
  using namespace std::string_view_literals;
  constexpr std::array kHeads = {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv};  // the latter two: BigTIFF
  return std::ranges::any_of(kHeads, [&](std::string_view head) { return first.starts_with(head); });
}

}  // namespace

std::string foreign_file(std::string_view first_bytes) {
  if (is_rtklib_solution(first_bytes))
    return "is a solution of RTKLIB, which has positions without an attitude and is not read: trajectories are read as "
           "SBET, and solutions of a receiver as it sends them (UBX, SBF, NMEA)";
  if (is_rinex(first_bytes))
    return "is a RINEX file, whose observations or orbits are not read: give the receiver's own log";
  if (has_abbreviated_log(first_bytes))
    return "holds logs of a NovAtel receiver in abbreviated ASCII, which have no check sum and are not read: ask the "
           "receiver for logs in binary or ASCII (their names end with B or A, such as BESTPOSB)";
  if (has_oem3_message(first_bytes))
    return "holds logs of a NovAtel OEM3, which are not read: logs of OEM4 to OEM7 are";
  if (is_rtcm3(first_bytes))
    return "holds corrections (RTCM 3) and no positions: give the log of the receiver that they were sent to";
  if (is_ascii_grid(first_bytes))
    return "is a grid of heights or other values (Esri ASCII grid) and has no points: give the cloud that it was made "
           "of";
  if (first_bytes.starts_with("@ TEXT @"))
    return "is a trace of CARBUS Analyzer, which is not read: open it in SavvyCAN, and save it as a CAN log that is "
           "(CSV)";
  if (storage::is_image(std::as_bytes(std::span(first_bytes))))
    return "is an image: `hueline colour` takes it with a laser cloud of the same moment and a calibration";
  if (is_tiff(first_bytes))
    return "is an image (TIFF), which is not read: `hueline colour` takes it as PNG or JPEG, with a laser cloud of the "
           "same moment and a calibration";
  return {};
}

}  // namespace hueline::apps
