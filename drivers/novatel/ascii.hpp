#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/novatel/message_table.hpp"
#include "drivers/novatel/wire.hpp"

namespace hueline::drivers {

/// An ASCII log of a NovAtel receiver, converted to the binary message with the same content.
struct NovatelAsciiLog {
  NovatelHeader header;
  const NovatelMessageInfo* info = nullptr;
  std::vector<std::byte> body;  ///< bytes as in the binary message; empty for a log that is not used
};

/// Returns whether a line is an ASCII log: `#NAMEA,...` with a long header or `%NAMESA,...` with a short one.
bool is_novatel_ascii(std::string_view line);
/// Returns the name of the log without the format letter, such as "BESTPOS". Empty if the line is no ASCII log.
std::string_view novatel_ascii_name(std::string_view line);
/// Returns the message with this name if its ASCII log is used, else null.
const NovatelMessageInfo* find_novatel_ascii(std::string_view name);
/// Returns the number of an inertial solution status by the manual's word for it, such as INS_SOLUTION_GOOD; 65535, as
/// for other words in logs, if the manual does not have it.
std::uint32_t ins_status_of(std::string_view word);

/// Decodes a line from its '#' or '%' to its check sum, and ignores what follows. Source: OEM7 Commands and Logs
/// Reference Manual, "ASCII" and "32-Bit CRC". Errors: Unsupported (no ASCII log), Truncated (no check sum), Malformed
/// (the check sum, the header, or a field of a log that is used).
/// Thread safety: may be called from several threads at the same time.
Result<NovatelAsciiLog> decode_novatel_ascii(std::string_view line);

}  // namespace hueline::drivers
