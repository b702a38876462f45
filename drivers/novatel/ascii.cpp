#include "drivers/novatel/ascii.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "drivers/novatel/crc32.hpp"

namespace hueline::drivers {
namespace {

struct Word {
  std::string_view text;
  std::uint32_t number;
};

// GPS reference time status, solution status and clock status: the words of the manual and their numbers in binary
// messages.
constexpr std::array kTimeStatus{
    Word{"UNKNOWN", 20},        Word{"APPROXIMATE", 60},     Word{"COARSEADJUSTING", 80},
    Word{"COARSE", 100},        Word{"COARSESTEERING", 120}, Word{"FREEWHEELING", 130},
    Word{"FINEADJUSTING", 140}, Word{"FINE", 160},           Word{"FINEBACKUPSTEERING", 170},
    Word{"FINESTEERING", 180},  Word{"SATTIME", 200}};
constexpr std::array kInsStatus{Word{"INS_INACTIVE", 0},
                                Word{"INS_ALIGNING", 1},
                                Word{"INS_HIGH_VARIANCE", 2},
                                Word{"INS_SOLUTION_GOOD", 3},
                                Word{"INS_SOLUTION_FREE", 6},
                                Word{"INS_ALIGNMENT_COMPLETE", 7},
                                Word{"DETERMINING_ORIENTATION", 8},
                                Word{"WAITING_INITIALPOS", 9},
                                Word{"WAITING_AZIMUTH", 10},
                                Word{"INITIALIZING_BIASES", 11},
                                Word{"MOTION_DETECT", 12}};
constexpr std::array kPositionType{Word{"NONE", 0},
                                   Word{"FIXEDPOS", 1},
                                   Word{"FIXEDHEIGHT", 2},
                                   Word{"DOPPLER_VELOCITY", 8},
                                   Word{"SINGLE", 16},
                                   Word{"PSRDIFF", 17},
                                   Word{"WAAS", 18},
                                   Word{"PROPAGATED", 19},
                                   Word{"OMNISTAR", 20},
                                   Word{"L1_FLOAT", 32},
                                   Word{"IONOFREE_FLOAT", 33},
                                   Word{"NARROW_FLOAT", 34},
                                   Word{"L1_INT", 48},
                                   Word{"WIDE_INT", 49},
                                   Word{"NARROW_INT", 50},
                                   Word{"RTK_DIRECT_INS", 51},
                                   Word{"INS_SBAS", 52},
                                   Word{"INS_PSRSP", 53},
                                   Word{"INS_PSRDIFF", 54},
                                   Word{"INS_RTKFLOAT", 55},
                                   Word{"INS_RTKFIXED", 56},
                                   Word{"OMNISTAR_HP", 64},
                                   Word{"OMNISTAR_XP", 65},
                                   Word{"INS_OMNISTAR_HP", 66},
                                   Word{"INS_OMNISTAR_XP", 67},
                                   Word{"PPP_CONVERGING", 68},
                                   Word{"PPP", 69},
                                   Word{"INS_PPP_CONVERGING", 73},
                                   Word{"INS_PPP", 74},
                                   Word{"PPP_BASIC_CONVERGING", 77},
                                   Word{"PPP_BASIC", 78},
                                   Word{"INS_PPP_BASIC_CONVERGING", 79},
                                   Word{"INS_PPP_BASIC", 80}};
constexpr std::array kSolutionStatus{Word{"SOL_COMPUTED", 0}};
constexpr std::array kClockStatus{Word{"VALID", 0}, Word{"CONVERGING", 1}, Word{"ITERATING", 2}, Word{"INVALID", 3}};
constexpr std::array kUtcStatus{Word{"INVALID", 0}, Word{"VALID", 1}, Word{"WARNING", 2}};
/// The number of a word that is not in a table. Every decoder treats it as not good.
constexpr std::uint32_t kUnknownWord = 0xFFFF;

std::uint32_t number_of(std::span<const Word> words, std::string_view text) {
  for (const Word& word : words)
    if (word.text == text) return word.number;
  return kUnknownWord;
}

template <class T>
std::optional<T> parse(std::string_view text, int base = 10) {
  T value{};
  const char* end = text.data() + text.size();
  const auto result = [&] {
    if constexpr (std::is_floating_point_v<T>)
      return std::from_chars(text.data(), end, value);
    else
      return std::from_chars(text.data(), end, value, base);
  }();
  if (result.ec != std::errc{} || result.ptr != end) return {};
  return value;
}

std::string_view take(std::string_view& rest) {
  const std::size_t comma = rest.find(',');
  std::string_view field = rest.substr(0, comma);
  rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
  return field;
}

/// Returns the fields of a log that is used, in their order, one character each:
///   d, f     double, float
///   w, h, b  unsigned integer of 32, 16, 8 bits
///   X, B     unsigned integer of 32, 8 bits in hexadecimal
///   s        four characters in quotes
///   i        word of the INS status
///   p        word of the position type
///   o        word of the solution status
///   c        word of the clock status
///   u        word of the UTC status
///   e        a word that is not used
///   0, 8     two, eight bytes that the binary message has and the ASCII log does not
const char* fields_of(NovatelUse use) {
  switch (use) {
    case NovatelUse::InsPva:
    case NovatelUse::MarkPva:
      return "wddddddddddi";
    case NovatelUse::InsPvaX:
      return "ipdddfddddddfffffffffXh";
    case NovatelUse::InsStdev:
      return "fffffffffXh08";
    case NovatelUse::BestPos:
      return "opdddfefffsffbbbbBBBB";
    case NovatelUse::Time:
      return "cdddwbbbbwu";
    case NovatelUse::MarkTime:
      return "wddddc";
    default:
      return nullptr;
  }
}

class Body {
 public:
  template <class T>
  bool put(std::optional<T> value) {
    if (!value) return false;
    const auto* raw = reinterpret_cast<const std::byte*>(&*value);
    bytes.insert(bytes.end(), raw, raw + sizeof(T));
    return true;
  }
  bool put(char kind, std::string_view text) {
    const auto word = [&](std::span<const Word> words) { return put(std::optional(number_of(words, text))); };
    switch (kind) {
      case 'd':
        return put(parse<double>(text));
      case 'f':
        return put(parse<float>(text));
      case 'w':
        return put(parse<std::uint32_t>(text));
      case 'h':
        return put(parse<std::uint16_t>(text));
      case 'b':
        return put(parse<std::uint8_t>(text));
      case 'X':
        return put(parse<std::uint32_t>(text, 16));
      case 'B':
        return put(parse<std::uint8_t>(text, 16));
      case 's': {
        std::array<char, 4> station{};
        for (std::size_t i = 1; i + 1 < text.size() && i <= station.size(); ++i) station[i - 1] = text[i];
        return put(std::optional(station));
      }
      case 'i':
        return word(kInsStatus);
      case 'p':
        return word(kPositionType);
      case 'o':
        return word(kSolutionStatus);
      case 'c':
        return word(kClockStatus);
      case 'u':
        return word(kUtcStatus);
      default:
        return put(std::optional(kUnknownWord));
    }
  }
  std::vector<std::byte> bytes;
};

Error malformed(std::string what) { return {ErrorCode::Malformed, std::move(what)}; }

}  // namespace

const NovatelMessageInfo* find_novatel_ascii(std::string_view name) {
  // INSPVA(S), INSPVAX, INSSTDEV(S), BESTPOS, TIME, MARKxTIME, MARKxPVA.
  constexpr std::uint16_t kUsed[] = {42,   101,  231,  507,  508,  616,  1067, 1068,
                                     1075, 1076, 1118, 1119, 1130, 1465, 2051, 2052};
  for (const std::uint16_t id : kUsed)
    if (const NovatelMessageInfo* info = find_novatel_message(id); info && name == info->name) return info;
  return nullptr;
}

bool is_novatel_ascii(std::string_view line) { return !novatel_ascii_name(line).empty(); }

std::string_view novatel_ascii_name(std::string_view line) {
  if (line.size() < 4 || (line[0] != '#' && line[0] != '%')) return {};
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos) return {};
  std::string_view name = line.substr(1, comma - 1);
  if (name.size() > 2 && name[name.size() - 2] == '_') name.remove_suffix(2);  // suffix of the secondary antenna
  if (name.size() < 2 || name.back() != 'A') return {};
  for (const char c : name)
    if ((c < 'A' || c > 'Z') && (c < '0' || c > '9')) return {};
  name.remove_suffix(1);
  return name;
}

std::uint32_t ins_status_of(std::string_view word) { return number_of(kInsStatus, word); }

Result<NovatelAsciiLog> decode_novatel_ascii(std::string_view line) {
  const std::string_view name = novatel_ascii_name(line);
  if (name.empty()) return Error{ErrorCode::Unsupported, "no ASCII log"};
  const std::size_t star = line.rfind('*');
  if (star == std::string_view::npos || line.size() < star + 9)
    return Error{ErrorCode::Truncated, fmt::format("{} in ASCII without its check sum", name)};
  const auto sum = parse<std::uint32_t>(line.substr(star + 1, 8), 16);
  if (!sum || *sum != novatel_crc32(std::as_bytes(std::span(line.substr(1, star - 1)))))
    return malformed(fmt::format("{} in ASCII: its check sum is wrong", name));
  const std::size_t semicolon = line.find(';');
  if (semicolon == std::string_view::npos || semicolon > star)
    return malformed(fmt::format("{} in ASCII without a header", name));

  NovatelAsciiLog out;
  std::string_view header = line.substr(1, semicolon - 1);
  const std::string_view full_name = take(header);
  out.header.is_short = line[0] == '%';
  out.header.antenna = full_name.ends_with("_1") ? 1 : 0;
  if (!out.header.is_short) {
    for (int i = 0; i < 3; ++i) take(header);  // port, sequence number, idle time
    out.header.time_status = static_cast<std::uint8_t>(number_of(kTimeStatus, take(header)));
  }
  const auto week = parse<std::uint16_t>(take(header));
  const auto seconds = parse<double>(take(header));
  if (!week || !seconds || !(*seconds >= 0) || !(*seconds < 1e6))
    return malformed(fmt::format("{} in ASCII: its header names no time", name));
  out.header.week = *week;
  out.header.milliseconds = static_cast<std::uint32_t>(std::llround(*seconds * 1000));
  out.info = find_novatel_ascii(name);
  if (!out.info) return out;
  out.header.id = out.info->id;
  const char* fields = fields_of(out.info->use);
  if (!fields) return out;
  Body body;
  std::string_view rest = line.substr(semicolon + 1, star - semicolon - 1);
  for (const char* kind = fields; *kind; ++kind) {
    if (*kind == '0' || *kind == '8') {
      body.bytes.resize(body.bytes.size() + (*kind == '0' ? 2 : 8));
    } else if (const std::string_view text = take(rest); !body.put(*kind, text)) {
      return malformed(fmt::format("{} in ASCII: field {} is '{}'", name, kind - fields + 1, text.substr(0, 20)));
    }
  }
  out.body = std::move(body.bytes);
  return out;
}

}  // namespace hueline::drivers
