#include "storage/pcd_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/line_words.hpp"
#include "core/number_word.hpp"

namespace hueline::storage {
namespace {

bool is_known_type(char type, std::size_t size) {
  if (type == 'F') return size == 4 || size == 8;
  return (type == 'I' || type == 'U') && (size == 1 || size == 2 || size == 4 || size == 8);
}

Error malformed(const std::string& name, std::size_t line, const std::string& what) {
  return {ErrorCode::Malformed, fmt::format("{}:{}: not a PCD header: {}", name, line, what)};
}

/// Returns the encoding of this name, or nothing.
std::optional<PcdEncoding> encoding_of(std::string_view name) {
  if (name == "ascii") return PcdEncoding::Ascii;
  if (name == "binary") return PcdEncoding::Binary;
  if (name == "binary_compressed") return PcdEncoding::Compressed;
  return {};
}

/// Checks that the lines of the header fit together and that its types can be read. `line` is that of DATA.
Status check_columns(const PcdHeader& header, const std::string& name, std::size_t line) {
  const std::size_t n = header.fields.size();
  if (n == 0 || header.sizes.size() != n || header.types.size() != n || header.counts.size() != n)
    return malformed(name, line,
                     fmt::format("FIELDS names {} fields, SIZE has {}, TYPE {} and COUNT {}", n, header.sizes.size(),
                                 header.types.size(), header.counts.size()));
  std::size_t columns = 0;
  for (std::size_t i = 0; i < n; ++i) {
    // Fields of padding, and fields with no values, are not read, so their size and type are not checked.
    const bool is_read = header.counts[i] > 0 && !header.is_padding(i);
    if (is_read && !is_known_type(header.types[i], header.sizes[i]))
      return malformed(name, line,
                       fmt::format("field {}: type {} of {} bytes; known: I and U of 1, 2, 4, 8, F of 4, 8",
                                   header.fields[i], header.types[i], header.sizes[i]));
    columns += header.counts[i];
  }
  if (columns > kMostPcdColumns)
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: has {} columns; clouds of at most {} are read", name, columns, kMostPcdColumns)};
  return {};
}

}  // namespace

Result<PcdHeader> read_pcd_header(std::string_view text, const std::string& name) {
  PcdHeader header;
  std::size_t begin = 0, line_number = 0, width = 0, height = 1;
  bool has_points = false;
  const bool is_longer = text.size() > kMostPcdHeader;
  text = text.substr(0, kMostPcdHeader);
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    const auto words = line_words(text.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string_view key = words[0];
    for (std::size_t i = 1; i < words.size(); ++i) {
      std::size_t number = 0;
      if (key == "FIELDS" || key == "COLUMNS") header.fields.emplace_back(words[i]);
      if (key == "TYPE") header.types.push_back(words[i][0]);
      if (key == "SIZE" || key == "COUNT" || key == "POINTS" || key == "WIDTH" || key == "HEIGHT") {
        const std::size_t most = key == "SIZE" || key == "COUNT" ? kMostPcdColumns : 2'000'000'000u;
        if (!read_number(words[i], number) || number > most)
          return malformed(name, line_number,
                           fmt::format("{} is '{}'; allowed: a whole number from 0 to {}", key, words[i], most));
        if (key == "WIDTH") width = number;
        if (key == "HEIGHT") height = number;
        has_points |= key == "POINTS";
        if (key == "SIZE") header.sizes.push_back(number);
        if (key == "COUNT") header.counts.push_back(number);
        if (key == "POINTS") header.points = number;
      }
    }
    if (key != "DATA") continue;
    if (words.size() != 2) return malformed(name, line_number, "DATA has no encoding, or more than one");
    const auto encoding = encoding_of(words[1]);
    if (!encoding)
      return malformed(name, line_number,
                       fmt::format("DATA is '{}'; allowed: ascii, binary, binary_compressed", words[1]));
    header.encoding = *encoding;
    if (header.counts.empty()) header.counts.assign(header.fields.size(), 1);
    if (const Status good = check_columns(header, name, line_number); !good.ok()) return good.error();
    if (!has_points) header.points = std::min<std::size_t>(width * height, 2'000'000'000u);
    header.data_begin = begin;
    return header;
  }
  if (is_longer)
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: no DATA line within its first {} kB: not a PCD file, or one with too many columns",
                             name, kMostPcdHeader / 1024)};
  return Error{ErrorCode::Truncated, fmt::format("{}: no DATA line: not a PCD file, or cut inside its header", name)};
}

}  // namespace hueline::storage
