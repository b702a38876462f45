#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hueline {

/// Returns the text of `json`: on one line, or with `indent` spaces a level. What comes from devices and files may have
/// any encoding, so bytes that are no UTF-8 become U+FFFD instead of an error.
std::string json_text(const nlohmann::ordered_json& json, int indent = -1);

}  // namespace hueline
