#pragma once

#include <optional>
#include <string>
#include <string_view>

/// Base64 (RFC 4648, section 4).
namespace hueline {

/// Returns the text of bytes, padded to whole groups of four.
std::string base64(std::string_view bytes);
/// Returns the bytes of a text, whose padding may be left out; nothing if it is no Base64.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace hueline
