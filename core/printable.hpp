#pragma once

#include <string>
#include <string_view>

namespace hueline {

/// Whether printable() escapes line ends, or keeps them.
enum class LineEnds { Escape, Keep };

/// Makes text of unknown origin (from a device, a file, a name) safe to show anywhere. The result is valid UTF-8 and
/// contains nothing that controls a terminal or changes the direction of writing. Bytes that are not UTF-8, and control
/// characters, become \xNN, \n, \r, \t or \u{N}; everything else stays. A second call changes nothing more.
std::string printable(std::string_view text, LineEnds line_ends = LineEnds::Escape);

/// Writes out the signs that HTML and XML take for markup: & < > ".
std::string as_markup(std::string_view text);

/// Returns the text for an address of the web: every byte as %XX but letters, digits, "-._~" and, if `keeps_slashes`,
/// "/". Signatures of AWS want the same. Sources: RFC 3986, 2.1 and 2.3; "Create a signed AWS API request",
/// UriEncode().
std::string percent_encoded(std::string_view text, bool keeps_slashes);
/// Returns what percent_encoded() had, whatever was written as %XX. A "%" without two hexadecimal digits stays.
std::string percent_decoded(std::string_view text);

}  // namespace hueline
