#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "drivers/can/can_signal.hpp"

/// DBC files (Vector's text format), in which a vehicle's maker describes the messages on its buses.
namespace hueline::drivers {

/// One signal of a message (a line `SG_`).
struct DbcSignal {
  std::string name, unit;
  /// Only in some frames: in those in which the signal `selector` has a value of `selected_by`.
  bool is_multiplexed = false;
  bool is_selector = false;                                          ///< selects others ("M")
  std::string selector;                                              ///< empty if the signal is in every frame
  std::vector<std::pair<std::uint64_t, std::uint64_t>> selected_by;  ///< from .. to, both included
  CanSignal signal;
  std::map<std::int64_t, std::string> words;  ///< names of values (VAL_), by the bits
};
/// One message with its signals (a line `BO_`).
struct DbcMessage {
  std::uint32_t id = 0;
  bool is_extended = false;
  std::string name;
  int length = 0;
  std::vector<DbcSignal> signals;
};

/// The messages of a file, and what in it could not be read.
struct Dbc {
  std::vector<DbcMessage> messages;
  std::vector<std::string> troubles;  ///< each with the number of its line; the signals that they concern are left out

  /// Returns the message with that id, or null.
  const DbcMessage* find(std::uint32_t id, bool is_extended) const;
};

/// A signal in a frame.
struct DbcValue {
  const DbcSignal* signal = nullptr;
  std::int64_t raw = 0;  ///< the bits, sign-extended if the signal is signed
  double value = 0;      ///< after scale and offset
  /// The name of the value, or null.
  const std::string* word = nullptr;
};

/// Parses one line ` SG_ NAME : 0|16@1+ (0.0075,0) [0|491.49] "unit" RECEIVERS`. Error: Malformed, which says which
/// part is wrong.
Result<DbcSignal> parse_dbc_signal(std::string_view line);
/// Reads the messages of a DBC text, with multiplexing (also extended: SG_MUL_VAL_), names of values (VAL_) and
/// floating point numbers (SIG_VALTYPE_). Skips everything else. What is wrong is in `troubles`; the rest is read.
Dbc read_dbc(std::string_view text);
/// As read_dbc(), for a text that has to be right. Error: Malformed, the first trouble.
Result<std::vector<DbcMessage>> parse_dbc(std::string_view text);

/// A signal that decides by its value whether a frame has another one.
struct DbcSelection {
  CanSignal selector;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> values;  ///< from .. to, both included

  /// Returns whether the frame with the data `data` has a value of `values`. False if it is too short.
  bool holds(std::span<const std::uint8_t> data) const;
};
/// Returns the conditions under which a frame of `message` has `signal`: none, or those of its selector and of all that
/// select the selector. Error: Malformed, if a selector is missing or the selectors are in a circle.
Result<std::vector<DbcSelection>> selections(const DbcMessage& message, const DbcSignal& signal);

/// Decodes the signals that a frame with the data `data` has: those that it is long enough for, and of the multiplexed
/// ones those that are selected.
std::vector<DbcValue> decode(const DbcMessage& message, std::span<const std::uint8_t> data);

}  // namespace hueline::drivers
