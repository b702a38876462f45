#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/novatel/message_table.hpp"
#include "drivers/novatel/wire.hpp"

namespace hueline::drivers {

/// An ASCII log of a NovAtel receiver as the binary message that says the same.
struct NovatelAsciiLog {
  NovatelHeader header;
  const NovatelMessageInfo* info = nullptr;
  std::vector<std::byte> body;  ///< as on the wire; empty of a log that is not used
};

/// Whether a line is an ASCII log: `#NAMEA,...` with a long header or `%NAMESA,...` with a short one.
bool is_novatel_ascii(std::string_view line);
/// The log's name without the format letter: "BESTPOS". Empty if the line is no ASCII log.
std::string_view novatel_ascii_name(std::string_view line);
/// The message of that name, if it is one that is used in ASCII; else null.
const NovatelMessageInfo* find_novatel_ascii(std::string_view name);

/// From '#' or '%' to the check sum; what follows is not looked at. Source: OEM7 Commands and Logs Reference Manual,
/// "ASCII" and "32-Bit CRC". Errors: Unsupported (no ASCII log), Truncated (no check sum), Malformed (check sum, header
/// or a field of a log that is used). Reentrant.
Result<NovatelAsciiLog> decode_novatel_ascii(std::string_view line);

}  // namespace hueline::drivers
