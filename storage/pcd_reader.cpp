#include "storage/pcd_reader.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

namespace hueline::storage {
namespace {

enum class Encoding { Ascii, Binary, Compressed };

struct Header {
  std::vector<std::string> fields;
  std::vector<std::size_t> sizes, counts;
  std::vector<char> types;
  std::size_t points = 0;
  Encoding encoding = Encoding::Ascii;
  std::size_t data_begin = 0;

  std::size_t record_bytes() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) sum += sizes[i] * counts[i];
    return sum;
  }
};

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> out;
  std::size_t i = 0;
  while (i < line.size()) {
    while (i < line.size() && (line[i] == ' ' || line[i] == '\t' || line[i] == '\r')) ++i;
    const std::size_t begin = i;
    while (i < line.size() && line[i] != ' ' && line[i] != '\t' && line[i] != '\r') ++i;
    if (i > begin) out.push_back(line.substr(begin, i - begin));
  }
  return out;
}

template <class T>
bool parse(std::string_view word, T& out) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc() && end == word.data() + word.size();
}

bool is_known_type(char type, std::size_t size) {
  if (type == 'F') return size == 4 || size == 8;
  return (type == 'I' || type == 'U') && (size == 1 || size == 2 || size == 4 || size == 8);
}

Error malformed(const std::string& name, std::size_t line, const std::string& what) {
  return {ErrorCode::Malformed, fmt::format("{}:{}: not a PCD header: {}", name, line, what)};
}

Result<Header> read_header(std::string_view text, const std::string& name) {
  Header header;
  std::size_t begin = 0, line_number = 0;
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    const auto words = words_of(text.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string_view key = words[0];
    for (std::size_t i = 1; i < words.size(); ++i) {
      std::size_t number = 0;
      if (key == "FIELDS") header.fields.emplace_back(words[i]);
      if (key == "TYPE") header.types.push_back(words[i][0]);
      if (key == "SIZE" || key == "COUNT" || key == "POINTS") {
        if (!parse(words[i], number) || number > (key == "POINTS" ? 2'000'000'000u : 4096u))
          return malformed(name, line_number, fmt::format("{} '{}'", key, words[i]));
        if (key == "SIZE") header.sizes.push_back(number);
        if (key == "COUNT") header.counts.push_back(number);
        if (key == "POINTS") header.points = number;
      }
    }
    if (key != "DATA") continue;
    if (words.size() != 2) return malformed(name, line_number, "DATA without its encoding");
    if (words[1] == "ascii") header.encoding = Encoding::Ascii;
    else if (words[1] == "binary") header.encoding = Encoding::Binary;
    else if (words[1] == "binary_compressed") header.encoding = Encoding::Compressed;
    else return malformed(name, line_number, fmt::format("DATA '{}'; ascii, binary or binary_compressed", words[1]));
    if (header.counts.empty()) header.counts.assign(header.fields.size(), 1);
    const std::size_t n = header.fields.size();
    if (n == 0 || header.sizes.size() != n || header.types.size() != n || header.counts.size() != n)
      return malformed(name, line_number, "FIELDS, SIZE, TYPE and COUNT differ in length");
    for (std::size_t i = 0; i < n; ++i)
      if (!is_known_type(header.types[i], header.sizes[i]) || header.counts[i] == 0)
        return malformed(name, line_number, fmt::format("field {}: type {} of {} bytes", header.fields[i], header.types[i], header.sizes[i]));
    header.data_begin = begin;
    return header;
  }
  return Error{ErrorCode::Truncated, fmt::format("{}: no DATA line: not a PCD file, or cut inside its header", name)};
}

template <class T>
double load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double number_at(const std::byte* at, char type, std::size_t size) {
  if (type == 'F') return size == 4 ? load<float>(at) : load<double>(at);
  if (type == 'I') return size == 1 ? load<std::int8_t>(at) : size == 2 ? load<std::int16_t>(at) : size == 4 ? load<std::int32_t>(at) : load<std::int64_t>(at);
  return size == 1 ? load<std::uint8_t>(at) : size == 2 ? load<std::uint16_t>(at) : size == 4 ? load<std::uint32_t>(at) : load<std::uint64_t>(at);
}

/// LZF, the compression of PCD: a control byte below 32 copies that many + 1 literals, others refer back.
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
    for (std::size_t k = 0; k < n; ++k, ++o) out[o] = out[o - back];  // may overlap: byte by byte is the meaning
  }
  return o == out.size();
}

/// Lays out one column a value of each field.
void name_columns(const Header& header, PcdCloud& cloud) {
  for (std::size_t f = 0; f < header.fields.size(); ++f)
    for (std::size_t k = 0; k < header.counts[f]; ++k) cloud.fields.push_back(header.fields[f]);
  cloud.columns.resize(cloud.fields.size());
}

Result<PcdCloud> read_ascii(const Header& header, std::string_view text, const std::string& name) {
  PcdCloud cloud;
  name_columns(header, cloud);
  std::size_t begin = header.data_begin, row = 0;
  while (row < header.points && begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const auto words = words_of(text.substr(begin, end - begin));
    begin = end + 1;
    if (words.empty()) continue;
    if (words.size() != cloud.columns.size())
      return Error{ErrorCode::Malformed, fmt::format("{}: point {}: {} values, the header names {}", name, row, words.size(), cloud.columns.size())};
    for (std::size_t c = 0; c < words.size(); ++c) {
      double value = 0;
      if (!parse(words[c], value))
        return Error{ErrorCode::Malformed, fmt::format("{}: point {}: '{}' is not a number", name, row, words[c])};
      cloud.columns[c].push_back(value);
    }
    ++row;
  }
  if (row < header.points)
    return Error{ErrorCode::Truncated, fmt::format("{}: {} points of the {} that the header promises", name, row, header.points)};
  return cloud;
}

/// `stride` between values of one field, `begin` of each field: what differs between row-wise and column-wise data.
void take(const Header& header, std::span<const std::byte> data, bool by_column, PcdCloud& cloud) {
  name_columns(header, cloud);
  const std::size_t record = header.record_bytes();
  std::size_t column = 0, field_offset = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const std::size_t size = header.sizes[f], width = size * header.counts[f];
    const std::size_t begin = by_column ? field_offset * header.points : field_offset;
    for (std::size_t k = 0; k < header.counts[f]; ++k, ++column) {
      auto& out = cloud.columns[column];
      out.resize(header.points);
      for (std::size_t p = 0; p < header.points; ++p)
        out[p] = number_at(data.data() + begin + p * (by_column ? width : record) + k * size, header.types[f], size);
    }
    field_offset += width;
  }
}

Result<PcdCloud> read_binary(const Header& header, std::span<const std::byte> bytes, const std::string& name) {
  std::span<const std::byte> data = bytes.subspan(header.data_begin);
  const std::size_t wanted = header.points * header.record_bytes();
  std::vector<std::byte> expanded;
  const bool compressed = header.encoding == Encoding::Compressed;
  if (compressed) {
    if (data.size() < 8) return Error{ErrorCode::Truncated, fmt::format("{}: cut before the compressed sizes", name)};
    std::uint32_t packed = 0, unpacked = 0;
    std::memcpy(&packed, data.data(), 4);
    std::memcpy(&unpacked, data.data() + 4, 4);
    if (data.size() - 8 < packed)
      return Error{ErrorCode::Truncated, fmt::format("{}: {} compressed bytes of {}", name, data.size() - 8, packed)};
    // LZF expands at most 264 times 3: a header that promises more is not believed with memory.
    if (unpacked != wanted || wanted / 90 > packed)
      return Error{ErrorCode::Malformed, fmt::format("{}: {} bytes unpacked, the header means {}", name, unpacked, wanted)};
    expanded.resize(wanted);
    if (!expand_lzf(data.subspan(8, packed), expanded))
      return Error{ErrorCode::Malformed, fmt::format("{}: its compressed data do not unpack", name)};
    data = expanded;
  }
  if (data.size() < wanted)
    return Error{ErrorCode::Truncated, fmt::format("{}: {} bytes of points, the header means {}", name, data.size(), wanted)};
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

Result<PcdCloud> decode_pcd(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Result<Header> header = read_header(text, name);
  if (!header.ok()) return header.error();
  return header->encoding == Encoding::Ascii ? read_ascii(*header, text, name) : read_binary(*header, bytes, name);
}

Result<PcdCloud> read_pcd(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return io_error("open " + path, errno);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
  return decode_pcd(std::as_bytes(std::span(bytes)), path);
}

}  // namespace hueline::storage
