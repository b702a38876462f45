#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/can/can_signal.hpp"

/// DBC files (Vector's text format), in which a vehicle's maker describes the messages on its buses.
namespace hueline::drivers {

/// One signal of a message (a line `SG_`).
struct DbcSignal {
  std::string name, unit;
  bool is_multiplexed = false;  ///< only in some frames, selected by another signal; such signals are not read
  CanSignal signal;
};
/// One message with its signals (a line `BO_`).
struct DbcMessage {
  std::uint32_t id = 0;
  bool is_extended = false;
  std::string name;
  int length = 0;
  std::vector<DbcSignal> signals;
};

/// Parses one line ` SG_ NAME : 0|16@1+ (0.0075,0) [0|491.49] "unit" RECEIVERS`. Error: Malformed, which says which
/// part is wrong.
Result<DbcSignal> parse_dbc_signal(std::string_view line);
/// Parses the messages and signals of a DBC text and skips everything else. Error: Malformed, with the number of the
/// line.
Result<std::vector<DbcMessage>> parse_dbc(std::string_view text);

}  // namespace hueline::drivers
