#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hueline {

/// The one of `words` that was probably meant by `typed`: letters wrong, missing, too many or exchanged, at most one in
/// three. Empty if none is that near. Of equally near ones the first.
std::string nearest_word(std::string_view typed, const std::vector<std::string>& words);

/// "; did you mean WORD?", or nothing: the end of a sentence about an unknown word.
std::string did_you_mean(std::string_view typed, const std::vector<std::string>& words);

}  // namespace hueline
