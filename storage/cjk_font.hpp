#pragma once

#include <string_view>

namespace hueline::storage {

/// Returns the file of the font Droid Sans Fallback (Apache-2.0), a part of the program: Chinese, Japanese and Korean
/// characters without Latin ones. A document that shows them takes their shapes from here, and not from the fonts of
/// the computer, so that it has the same bytes everywhere.
std::string_view cjk_font();

}  // namespace hueline::storage
