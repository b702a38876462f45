#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hueline {

/// Returns the one of `words` that was probably meant by `typed`, or an empty text. Wrong, missing, additional and
/// exchanged letters are counted; at most a third of the letters may be wrong. Of equally near words the first is
/// returned.
std::string nearest_word(std::string_view typed, const std::vector<std::string>& words);

/// Returns "; did you mean WORD?" or an empty text. It is the end of a message about an unknown word.
std::string did_you_mean(std::string_view typed, const std::vector<std::string>& words);

}  // namespace hueline
