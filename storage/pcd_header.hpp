#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

/// The text header of a PCD file.
namespace hueline::storage {

/// Limit of a header's length in bytes. The headers that PCL writes take a few hundred bytes.
constexpr std::size_t kMostPcdHeader = 64 * 1024;
constexpr std::size_t kMostPcdColumns = 4096;

enum class PcdEncoding { Ascii, Binary, Compressed };

/// The header of a PCD file. The vectors have one element for each field.
struct PcdHeader {
  std::vector<std::string> fields;
  std::vector<std::size_t> sizes;   ///< bytes of one value, of each field
  std::vector<std::size_t> counts;  ///< values of one point, of each field; a field with no values is not stored
  std::vector<char> types;          ///< I, U, F
  std::size_t points = 0;
  PcdEncoding encoding = PcdEncoding::Ascii;
  std::size_t data_begin = 0;  ///< byte behind the DATA line

  /// Returns whether a field is padding: PCL writes the gaps between the members of a C++ structure as fields of this
  /// name.
  bool is_padding(std::size_t field) const { return fields[field] == "_"; }
  /// Returns the bytes of one point in binary data.
  std::size_t record_bytes() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) sum += sizes[i] * counts[i];
    return sum;
  }
};

/// Reads the header; `text` may continue behind it. `name` stands for the file in messages. Errors: Malformed with the
/// line; Truncated if there is no DATA line; Unsupported if there are more columns or a longer header than the limits
/// above.
Result<PcdHeader> read_pcd_header(std::string_view text, const std::string& name);

}  // namespace hueline::storage
