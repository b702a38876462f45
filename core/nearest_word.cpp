#include "core/nearest_word.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace hueline {
namespace {

constexpr std::size_t kLongest = 64;  // no key is longer; a longer word is not a typing error

/// Returns the number of letters to change, add, remove or exchange with their neighbour (optimal string alignment
/// distance).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, row(b.size() + 1), next(b.size() + 1);
  for (std::size_t k = 0; k <= b.size(); ++k) row[k] = k;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    next[0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      next[k] = std::min({row[k] + 1, next[k - 1] + 1, row[k - 1] + (a[i - 1] != b[k - 1])});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1])
        next[k] = std::min(next[k], before[k - 2] + 1);
    }
    before = row;
    std::swap(row, next);
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_word(std::string_view typed, const std::vector<std::string>& words) {
  std::string nearest;
  std::size_t least = kLongest;
  if (typed.size() > kLongest) return nearest;
  for (const std::string& word : words) {
    if (word.size() > kLongest) continue;
    const std::size_t off = distance(typed, word);
    if (off < least && 3 * off <= std::max(typed.size(), word.size())) {
      least = off;
      nearest = word;
    }
  }
  return nearest;
}

std::string did_you_mean(std::string_view typed, const std::vector<std::string>& words) {
  const std::string meant = nearest_word(typed, words);
  return meant.empty() ? meant : "; did you mean " + meant + "?";
}

}  // namespace hueline
