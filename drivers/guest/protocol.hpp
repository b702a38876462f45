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

/// The messages between the program (the host) and a guest. A guest is a process that speaks to a device through a
/// library of another maker, so that a crash of the library ends only the guest. Messages go over a socket pair
/// (AF_UNIX, SOCK_SEQPACKET: each message is one datagram, messages stay in order, and each side sees when the other
/// one ends). Packets lie in shared memory.
///
/// The order of messages:
///   1. The host sends Config. The guest connects its device.
///   2. The guest sends NeedMemory with the size of a packet.
///   3. The host sends Memory, with the descriptor of a sealed memfd of equal slots.
///      It also sends GiveBack with the slots that the guest may write.
///   4. The guest sends Running, and then Done for each slot that holds a packet. GiveBack returns the slot later.
///   5. The guest sends Loss when something was lost. It sends Failed when it cannot go on, and ends.
///   6. The host sends Stop and closes its end.
/// During all this the guest sends Alive as long as the library's current call is within its allowed time. It sends
/// LastWill when it has taken control of a device that would refuse a second controller.
///
/// A message is a u32 kind and then the members below, little endian like the machine (both ends are one machine). A
/// text or list takes the rest of the message. Nothing that a guest sends is trusted: the decode functions check sizes,
/// and the host checks slots.
///
///   kind  message     members
///      1  Config      u32 length of driver, text driver, text text
///      2  Memory      u64 slot_bytes, u32 slots
///      3  GiveBack    u32 for each slot
///      4  Stop
///    101  Alive
///    102  LastWill    u8[4] from, u8[4] to, u16 from_port, u16 to_port, datagram
///    103  NeedMemory  u64 packet_bytes
///    104  Running
///    105  Done        u32 slot, u64 bytes, i64 received, ns
///    106  Loss        i64 time, ns, fault as encode_fault() writes it
///    107  Failed      u8 error code, text message
namespace hueline::drivers::guest {

constexpr std::size_t kMostMessageBytes = 60'000;
constexpr std::size_t kMostSlots = 11'000;                          ///< in one memory
constexpr std::uint64_t kMostPacketBytes = std::uint64_t{1} << 30;  ///< in one slot
constexpr std::size_t kMostTextBytes = 2'000;                       ///< of an error or fault; a longer text is cut

// From the host to the guest.
struct Config {
  std::string driver;  ///< the rig's word, such as "genicam"
  std::string text;    ///< the driver's settings, as config_text.hpp writes them
};
/// The shared memory. Its descriptor comes with the message.
struct Memory {
  std::uint64_t slot_bytes = 0;
  std::uint32_t slots = 0;
};
/// Slots that the guest may write.
struct GiveBack {
  std::vector<std::uint32_t> slots;
};
struct Stop {};

// From the guest to the host.
struct Alive {};
/// A datagram that the host sends if the guest ends without a message. It releases the device, which would otherwise
/// refuse the next guest.
struct LastWill {
  std::array<std::uint8_t, 4> from{}, to{};  ///< IPv4 addresses; `from` and its port are those of the dead guest
  std::uint16_t from_port = 0, to_port = 0;
  std::vector<std::byte> datagram;  ///< at most 64 bytes
};
/// Asks for memory for packets of at most this size.
struct NeedMemory {
  std::uint64_t packet_bytes = 0;
};
struct Running {};
/// A slot holds a packet of `bytes` bytes, received at `received`.
struct Done {
  std::uint32_t slot = 0;
  std::uint64_t bytes = 0;
  HostTime received{};
};
/// Something was lost.
struct Loss {
  Fault fault;  ///< its sensor is not sent
};
/// The guest cannot go on, and ends.
struct Failed {
  Error error;
};

using ToGuest = std::variant<Config, Memory, GiveBack, Stop>;
using ToHost = std::variant<Alive, LastWill, NeedMemory, Running, Done, Loss, Failed>;

/// Makes one visitor of several functions, one for each kind of message.
template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

/// Encode a message as the table above says. Longer texts of errors and faults are cut.
std::vector<std::byte> encode(const ToGuest& message);
std::vector<std::byte> encode(const ToHost& message);
/// Decode a message. Error: Malformed (unknown kind, wrong size, or a value out of its range). Texts become printable
/// ASCII.
Result<ToGuest> decode_for_guest(std::span<const std::byte> bytes);
Result<ToHost> decode_for_host(std::span<const std::byte> bytes);

/// Replaces line breaks and tabs by a space and other unprintable characters by '?'. Keeps at most the last `most`
/// characters.
std::string printable(std::string_view text, std::size_t most = kMostTextBytes);

}  // namespace hueline::drivers::guest
