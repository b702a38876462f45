#pragma once

#include <charconv>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

/// The text at the begin of a PCD file.
namespace hueline::storage {

/// A header ends within these; what PCL writes takes hundreds of bytes.
constexpr std::size_t kMostPcdHeader = 64 * 1024;
constexpr std::size_t kMostPcdColumns = 4096;

enum class PcdEncoding { Ascii, Binary, Compressed };

struct PcdHeader {
  std::vector<std::string> fields;
  std::vector<std::size_t> sizes,
      counts;               ///< of each field: bytes of a value, values of a point; a field of no values is not stored
  std::vector<char> types;  ///< I, U, F
  std::size_t points = 0;
  PcdEncoding encoding = PcdEncoding::Ascii;
  std::size_t data_begin = 0;  ///< byte behind the DATA line

  /// The space between fields of a C++ structure: PCL writes it as fields of this name.
  bool is_padding(std::size_t field) const { return fields[field] == "_"; }
  std::size_t record_bytes() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) sum += sizes[i] * counts[i];
    return sum;
  }
};

/// `text` may go on behind the header. Malformed with the line, Truncated without a DATA line, Unsupported with more
/// columns or a longer header than the limits above; `name` stands for the file in messages.
Result<PcdHeader> read_pcd_header(std::string_view text, const std::string& name);

/// The words of a line, parted by blanks and tabs.
std::vector<std::string_view> pcd_words(std::string_view line);

/// True if the whole word is a number of T.
template <class T>
bool parse_pcd_number(std::string_view word, T& out) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc() && end == word.data() + word.size();
}

}  // namespace hueline::storage
