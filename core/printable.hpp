#pragma once

#include <string>
#include <string_view>

namespace hueline {

enum class LineEnds { Escape, Keep };

/// Text of unknown origin (a device, a file, a name) as it can be shown anywhere: UTF-8 for certain, and nothing in it
/// that steers a terminal or turns the direction of writing. Bytes that are no UTF-8 and control characters become
/// \xNN, \n, \r, \t or \u{N}; all else stays. Doing it twice changes nothing more.
std::string printable(std::string_view text, LineEnds line_ends = LineEnds::Escape);

}  // namespace hueline
