#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

namespace hueline {

/// Returns the words of a line, which are separated by any of `blanks`. They are views of the line.
inline std::vector<std::string_view> line_words(std::string_view line, const char* blanks = " \t\r") {
  std::vector<std::string_view> out;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t begin = line.find_first_not_of(blanks, at);
    if (begin == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(blanks, begin), line.size());
    out.push_back(line.substr(begin, end - begin));
    at = end;
  }
  return out;
}

}  // namespace hueline
