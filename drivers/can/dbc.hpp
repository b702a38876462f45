#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/can/can_signal.hpp"

/// DBC files: what a vehicle's maker says of the messages on its buses (Vector's text format).
namespace hueline::drivers {

struct DbcSignal {
  std::string name, unit;
  bool is_multiplexed = false;  ///< there in some frames alone, by the value of another signal: not read by us
  CanSignal signal;
};
struct DbcMessage {
  std::uint32_t id = 0;
  bool is_extended = false;
  std::string name;
  int length = 0;
  std::vector<DbcSignal> signals;
};

/// One line ` SG_ NAME : 0|16@1+ (0.0075,0) [0|491.49] "unit" RECEIVERS`. Malformed says which part.
Result<DbcSignal> parse_dbc_signal(std::string_view line);
/// The messages and signals of a DBC text; everything else in it is passed over. Malformed names the line.
Result<std::vector<DbcMessage>> parse_dbc(std::string_view text);

}  // namespace hueline::drivers
