#include "drivers/novatel/novatel_device.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "drivers/novatel/ascii.hpp"

namespace hueline::drivers {

void NovatelDevice::visit(Keys& keys) {
  input_.visit(keys, "A log of the receiver, binary or ASCII (`#...A`, `%...A`).");
  keys.section({"logs", "", "What the receiver is asked for after each connection. `{}` asks for the defaults.",
                "nothing is sent"},
               logs_);
  decoder_.visit(keys);
}

// value() is safe: the rig's reader has already checked the logs.
std::string NovatelDevice::dialogue() const { return logs_ ? novatel_dialogue(*logs_).value() : std::string(); }

std::unique_ptr<PacketSource> NovatelDevice::make_source(const BufferPool& pool) const {
  return input_.make(pool, dialogue());
}

std::unique_ptr<Decoder> NovatelDevice::make_decoder() const { return std::make_unique<NovatelDecoder>(decoder_); }

namespace {

/// Returns whether a line begins as an ASCII log:
/// #NAME,port,sequence,idle,status,week,seconds,receiver,reserved,version; or %NAME,week,seconds;
bool begins_ascii_log(std::string_view line) {
  if (line.empty() || (line[0] != '#' && line[0] != '%')) return false;
  const std::size_t end = line.find(';');
  if (end == std::string_view::npos) return false;
  const std::string_view head = line.substr(1, end - 1);
  const std::string_view name = head.substr(0, head.find(','));
  const auto is_capital = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; };
  const auto is_of_number = [](char c) { return (c >= '0' && c <= '9') || c == '.'; };
  const std::size_t week_at = line[0] == '#' ? 5 : 1, commas = line[0] == '#' ? 9 : 2;
  if (name.size() < 4 || !std::ranges::all_of(name, is_capital) ||
      static_cast<std::size_t>(std::ranges::count(head, ',')) != commas)
    return false;
  std::size_t at = 0;
  for (std::size_t i = 0; i < week_at; ++i) at = head.find(',', at) + 1;
  const std::string_view times = head.substr(at);  // the week, the seconds, and what comes behind
  const std::size_t comma = times.find(',');
  const std::string_view week = times.substr(0, comma), seconds = times.substr(comma + 1, times.find(',', comma + 1));
  return !week.empty() && std::ranges::all_of(week, is_of_number) && !seconds.empty() && is_of_number(seconds[0]);
}

/// OEM7 logs have no header and may begin in the middle of a message: a whole message, binary or ASCII, or the
/// beginning of an ASCII line, which may be long (RANGEA), stands among the first bytes.
bool is_oem7_log(std::string_view first_bytes) {
  for (std::size_t at = 0; at < first_bytes.size();) {
    const std::string_view line = first_bytes.substr(at, first_bytes.find('\n', at) - at);
    if (begins_ascii_log(line)) return true;
    at += line.size() + 1;
  }
  struct Search final : NovatelFramer::Sink {
    bool has_message = false;
    void on_message(const NovatelMessage&) override { has_message = true; }
    void on_text(std::string_view text, HostTime) override {
      has_message |= decode_novatel_ascii(text.substr(0, text.find_last_not_of("\r\n") + 1)).ok();
    }
    void on_skipped(std::uint64_t, std::uint64_t, std::uint16_t, HostTime) override {}
  } search;
  NovatelFramer framer({});
  framer.feed(std::as_bytes(std::span(first_bytes)), {}, search);
  return search.has_message;
}

}  // namespace

constinit const DeviceType kNovatel{
    .word = "novatel",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<NovatelDevice>,
    .files = {.log = {.format = "NovAtel OEM7 binary", .ending = ".gps", .is_beginning = is_oem7_log}},
    .solutions = "INSPVA, INSPVAS or INSPVAX (a suffix _1: of the secondary antenna, not used)"};

}  // namespace hueline::drivers
