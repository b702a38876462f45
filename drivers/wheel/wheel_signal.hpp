#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/can/can_signal.hpp"
#include "drivers/can/dbc.hpp"

/// Signals of a vehicle's wheels, as a rig names them and as a database of the bus describes them.
namespace hueline::drivers {

/// A signal whose bits the rig gives, or that it names and a database describes.
struct WheelSignal : CanSignal {
  std::string name;  ///< "MESSAGE.SIGNAL" in the database; empty if the rig gives the bits
  double unit = 1;   ///< of the value in m/s; find_signal() applies it to what the database says
  /// The conditions under which a frame has the signal. None: every frame has it.
  std::vector<DbcSelection> selections;

  WheelSignal() = default;
  WheelSignal(const CanSignal& other) : CanSignal(other) {}  // NOLINT(google-explicit-constructor): bits are a signal

  /// Returns whether a frame with these data has the signal. The data have needed_bytes().
  bool is_in(std::span<const std::uint8_t> data) const;
  /// Changes scale, offset and range by `factor`.
  void multiply(double factor);
};

/// A signal that a database describes, with its message.
struct FoundSignal {
  const DbcMessage* message = nullptr;
  WheelSignal signal;
};
/// Finds the signal that `named` names. Errors: Invalid, if there is none (with the names that are near), Malformed.
Result<FoundSignal> find_signal(const Dbc& database, const WheelSignal& named);

/// A packet that holds the text of a database: the characters "DBC1", then the text. The journal holds it in front of
/// the frames (docs/formats.md, "CAN").
std::vector<std::byte> encode_database_packet(std::string_view text);
/// Returns the text of such a packet, or nothing if it is another packet.
std::optional<std::string_view> decode_database_packet(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
