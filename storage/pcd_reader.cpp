#include "storage/pcd_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <string_view>

#include "core/input_file.hpp"
#include "core/line_words.hpp"
#include "core/number_word.hpp"
#include "storage/pcd_header.hpp"

namespace hueline::storage {
namespace {

template <class T>
double load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double number_at(const std::byte* at, char type, std::size_t size) {
  if (type == 'F') return size == 4 ? load<float>(at) : load<double>(at);
  if (type == 'I')
    return size == 1   ? load<std::int8_t>(at)
           : size == 2 ? load<std::int16_t>(at)
           : size == 4 ? load<std::int32_t>(at)
                       : load<std::int64_t>(at);
  return size == 1   ? load<std::uint8_t>(at)
         : size == 2 ? load<std::uint16_t>(at)
         : size == 4 ? load<std::uint32_t>(at)
                     : load<std::uint64_t>(at);
}

/// Decompresses LZF, the compression of PCD. A control byte below 32 is followed by that many + 1 literals; any other
/// refers back to earlier output.
bool expand_lzf(std::span<const std::byte> in, std::span<std::byte> out) {
  std::size_t i = 0, o = 0;
  while (i < in.size()) {
    const auto control = static_cast<std::size_t>(in[i++]);
    if (control < 32) {
      const std::size_t n = control + 1;
      if (i + n > in.size() || o + n > out.size()) return false;
      std::memcpy(out.data() + o, in.data() + i, n);
      i += n, o += n;
      continue;
    }
    std::size_t n = control >> 5;
    if (n == 7) {
      if (i >= in.size()) return false;
      n += static_cast<std::size_t>(in[i++]);
    }
    n += 2;
    if (i >= in.size()) return false;
    const std::size_t back = ((control & 31) << 8) + static_cast<std::size_t>(in[i++]) + 1;
    if (back > o || o + n > out.size()) return false;
    // The ranges may overlap, so bytes are copied one by one.
    for (std::size_t k = 0; k < n; ++k, ++o) out[o] = out[o - back];
  }
  return o == out.size();
}

/// Makes one column for each value of each field.
void name_columns(const PcdHeader& header, PcdCloud& cloud) {
  for (std::size_t f = 0; f < header.fields.size(); ++f)
    for (std::size_t k = 0; k < header.counts[f] && !header.is_padding(f); ++k) {
      cloud.fields.push_back(header.fields[f]);
      cloud.types.push_back({header.types[f], header.sizes[f]});
    }
  cloud.columns.resize(cloud.fields.size());
}

Result<PcdCloud> read_ascii(const PcdHeader& header, std::string_view text, const std::string& name) {
  PcdCloud cloud;
  name_columns(header, cloud);
  // The column of each word of a line, or kNowhere if the word is padding.
  constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> column_of;
  for (std::size_t f = 0, next = 0; f < header.fields.size(); ++f)
    for (std::size_t k = 0; k < header.counts[f]; ++k) column_of.push_back(header.is_padding(f) ? kNowhere : next++);
  std::size_t begin = header.data_begin, row = 0;
  while (row < header.points && begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const auto words = line_words(text.substr(begin, end - begin));
    begin = end + 1;
    if (words.empty()) continue;
    if (words.size() != column_of.size())
      return Error{ErrorCode::Malformed, fmt::format("{}: point {} has {} values; the header names {}", name, row,
                                                     words.size(), column_of.size())};
    for (std::size_t c = 0; c < words.size(); ++c) {
      if (column_of[c] == kNowhere) continue;
      double value = 0;
      if (!read_number(words[c], value))
        return Error{ErrorCode::Malformed, fmt::format("{}: point {}: '{}' is not a number", name, row, words[c])};
      cloud.columns[column_of[c]].push_back(value);
    }
    ++row;
  }
  if (row < header.points)
    return Error{ErrorCode::Truncated,
                 fmt::format("{}: holds {} of the {} points that its header counts", name, row, header.points)};
  return cloud;
}

/// Reads binary data. Row-wise and column-wise data differ in `stride`, from one value of a field to the next, and in
/// `begin`, the first byte of each field.
void take(const PcdHeader& header, std::span<const std::byte> data, bool by_column, PcdCloud& cloud) {
  name_columns(header, cloud);
  const std::size_t record = header.record_bytes();
  std::size_t column = 0, field_offset = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const std::size_t size = header.sizes[f], width = size * header.counts[f];
    const std::size_t begin = by_column ? field_offset * header.points : field_offset;
    for (std::size_t k = 0; k < header.counts[f] && !header.is_padding(f); ++k, ++column) {
      auto& out = cloud.columns[column];
      out.resize(header.points);
      for (std::size_t p = 0; p < header.points; ++p)
        out[p] = number_at(data.data() + begin + p * (by_column ? width : record) + k * size, header.types[f], size);
    }
    field_offset += width;
  }
}

Result<PcdCloud> read_binary(const PcdHeader& header, std::span<const std::byte> bytes, const std::string& name) {
  std::span<const std::byte> data = bytes.subspan(header.data_begin);
  const std::size_t wanted = header.points * header.record_bytes();
  std::vector<std::byte> expanded;
  const bool compressed = header.encoding == PcdEncoding::Compressed;
  if (compressed) {
    if (data.size() < 8)
      return Error{ErrorCode::Truncated, fmt::format("{}: ends before the sizes of its compressed data", name)};
    std::uint32_t packed = 0, unpacked = 0;
    std::memcpy(&packed, data.data(), 4);
    std::memcpy(&unpacked, data.data() + 4, 4);
    if (data.size() - 8 < packed)
      return Error{ErrorCode::Truncated,
                   fmt::format("{}: holds {} of {} compressed bytes", name, data.size() - 8, packed)};
    // LZF expands at most 264 to 3 bytes, so no memory is allocated for a header that promises more.
    if (unpacked != wanted || wanted / 90 > packed)
      return Error{ErrorCode::Malformed,
                   fmt::format("{}: its compressed data state {} bytes; its header needs {}", name, unpacked, wanted)};
    expanded.resize(wanted);
    if (!expand_lzf(data.subspan(8, packed), expanded))
      return Error{ErrorCode::Malformed, fmt::format("{}: its compressed data are damaged", name)};
    data = expanded;
  }
  if (data.size() < wanted)
    return Error{ErrorCode::Truncated,
                 fmt::format("{}: holds {} bytes of points; its header needs {}", name, data.size(), wanted)};
  PcdCloud cloud;
  take(header, data, compressed, cloud);
  return cloud;
}

}  // namespace

std::span<const double> PcdCloud::column(const std::string& field) const {
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (fields[i] == field) return columns[i];
  return {};
}

Error too_many_cloud_values(const std::string& name) {
  return {ErrorCode::Unsupported,
          fmt::format("{}: has more than {} values, which are not read into memory", name, kMostCloudValues)};
}

Result<PcdCloud> decode_points(const PcdHeader& header, std::span<const std::byte> bytes, const std::string& name) {
  std::size_t columns = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f) columns += header.is_padding(f) ? 0 : header.counts[f];
  if (columns > 0 && header.points > kMostCloudValues / columns)
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: has {} points of {} values; into memory at most {} values are read", name,
                             header.points, columns, kMostCloudValues)};
  if (header.encoding != PcdEncoding::Ascii) return read_binary(header, bytes, name);
  return read_ascii(header, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
}

Result<PcdCloud> decode_pcd(std::span<const std::byte> bytes, const std::string& name) {
  const auto header = read_pcd_header({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
  if (!header.ok()) return header.error();
  return decode_points(*header, bytes, name);
}

Result<PcdCloud> read_pcd(const std::string& path) {
  const Result<std::string> bytes = read_input(path, kMostCloudBytes, "a PCD that has to be whole in memory,");
  if (!bytes.ok()) return bytes.error();
  return decode_pcd(std::as_bytes(std::span(*bytes)), path);
}

}  // namespace hueline::storage
