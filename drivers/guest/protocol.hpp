#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/fault.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

/// What the program and a guest tell each other. A guest is a process that speaks to a device through somebody else's
/// library; the library's crash is the guest's alone. Messages go over a socketpair (AF_UNIX, SOCK_SEQPACKET: one
/// message a datagram, in order, and an end that is seen), packets lie in shared memory.
///
/// Conversation: the host sends Config. The guest connects its device and says NeedMemory with the size of a packet;
/// the host answers with Memory, whose descriptor (a sealed memfd of equal slots) travels with it, and GiveBack with
/// the slots that may be written. The guest says Running, and Done for each slot that holds a packet; GiveBack returns
/// it. Fault tells a loss, Failed that it is over; then the guest ends. All the while it says Alive, as long as its
/// library is within the time that the call under way may take. The host says Stop and hangs up.
///
/// Layout of a message: u32 kind, then the members in the order of the struct, little endian as the machine is (both
/// ends are one machine); texts and lists fill the rest. Nothing that a guest sends is trusted: decode_*() bounds
/// sizes, the host bounds slots.
namespace hueline::drivers::guest {

constexpr std::size_t kMostMessageBytes = 60'000;
constexpr std::size_t kMostSlots = 11'000;                          ///< of a memory
constexpr std::uint64_t kMostPacketBytes = std::uint64_t{1} << 30;  ///< of a slot
constexpr std::size_t kMostTextBytes = 2'000;                       ///< of an error or fault; longer ones are cut

// Host to guest.
struct Config {
  std::string driver;  ///< the rig's word: "genicam"
  std::string text;    ///< config_text.hpp
};
struct Memory {  ///< with a descriptor
  std::uint64_t slot_bytes = 0;
  std::uint32_t slots = 0;
};
struct GiveBack {
  std::vector<std::uint32_t> slots;
};
struct Stop {};

// Guest to host.
struct Alive {};
/// A datagram that the host sends for a guest that ended without a word: it lets go of the device, which would refuse a
/// successor else.
struct LastWill {
  std::array<std::uint8_t, 4> from{}, to{};  ///< IPv4; `from` and its port are the dead guest's own
  std::uint16_t from_port = 0, to_port = 0;
  std::vector<std::byte> datagram;  ///< at most 64 bytes
};
struct NeedMemory {
  std::uint64_t packet_bytes = 0;
};
struct Running {};
struct Done {
  std::uint32_t slot = 0;
  std::uint64_t bytes = 0;
  HostTime received{};
};
struct Loss {
  Fault fault;  ///< without its sensor
};
struct Failed {
  Error error;
};

using ToGuest = std::variant<Config, Memory, GiveBack, Stop>;
using ToHost = std::variant<Alive, LastWill, NeedMemory, Running, Done, Loss, Failed>;

std::vector<std::byte> encode(const ToGuest& message);
std::vector<std::byte> encode(const ToHost& message);
/// Malformed: no such message, wrong size, a value out of its range. Texts come out as printable ASCII.
Result<ToGuest> decode_for_guest(std::span<const std::byte> bytes);
Result<ToHost> decode_for_host(std::span<const std::byte> bytes);

/// Whatever is not printable ASCII becomes '?', line breaks a space; at most `most` characters, the last ones.
std::string printable(std::string_view text, std::size_t most = kMostTextBytes);

}  // namespace hueline::drivers::guest
