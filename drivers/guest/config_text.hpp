#pragma once

#include <string>
#include <string_view>

#include "core/keys.hpp"
#include "core/result.hpp"

/// A list of keys as text, for a process on the other side of a socket: a line `name value` for each key.
namespace hueline::drivers {

/// Returns the values of all keys of `group`. Empty texts and numbers that are not set have no line. The keys must be
/// numbers, flags, texts and words; a list or a section is a programming error.
std::string write_config(const KeyGroup& group);
/// Puts the values of `text` into the members of `group`. A member whose key has no line keeps its value. Errors:
/// Malformed, a line that names no key, or whose value is not allowed; the message says which.
Status read_config(std::string_view text, const KeyGroup& group);

}  // namespace hueline::drivers
