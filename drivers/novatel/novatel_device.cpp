#include "drivers/novatel/novatel_device.hpp"

#include <memory>
#include <span>

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

/// OEM7 logs have no header and may begin in the middle of a message: a whole message, binary or ASCII, stands among
/// the first bytes.
bool is_oem7_log(std::string_view first_bytes) {
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
