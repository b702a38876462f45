#include "storage/cloud_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/line_words.hpp"
#include "core/number_word.hpp"
#include "storage/e57_cloud.hpp"
#include "storage/e57_pages.hpp"
#include "storage/las_reader.hpp"
#include "storage/pcd_header.hpp"
#include "storage/text_cloud.hpp"

namespace hueline::storage {
namespace {

constexpr std::string_view kNpy = "\x93NUMPY";
constexpr float kFarthest_m = 1e4F;  // of a return, on each axis

struct PlyType {
  std::string_view names;  // with a blank on either side of each
  PcdType type;
};
constexpr std::array<PlyType, 8> kPlyTypes{{{" char int8 ", {'I', 1}},
                                            {" uchar uint8 ", {'U', 1}},
                                            {" short int16 ", {'I', 2}},
                                            {" ushort uint16 ", {'U', 2}},
                                            {" int int32 ", {'I', 4}},
                                            {" uint uint32 ", {'U', 4}},
                                            {" float float32 ", {'F', 4}},
                                            {" double float64 ", {'F', 8}}}};

const PlyType* find_ply_type(std::string_view word) {
  const auto* found = std::ranges::find_if(kPlyTypes, [&](const PlyType& one) {
    return one.names.find(fmt::format(" {} ", word)) != std::string_view::npos;
  });
  return found == kPlyTypes.end() ? nullptr : found;
}

struct PlyHeader {
  PcdHeader points;
  bool is_big_endian = false;
};

/// Reads the header of a PLY as that of a table of points.
Result<PlyHeader> read_ply_header(std::string_view text, const std::string& name) {
  const auto wrong = [&](std::string_view what) {
    return Error{ErrorCode::Malformed, fmt::format("{}: {}", name, what)};
  };
  const auto unsupported = [&](std::string_view what) {
    return Error{ErrorCode::Unsupported, fmt::format("{}: {}", name, what)};
  };
  PlyHeader out;
  PcdHeader& points = out.points;
  std::string_view element;
  bool has_vertices = false, has_format = false;
  const std::size_t most = std::min(text.size(), kMostPcdHeader);
  for (std::size_t begin = 0; begin < most;) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    const auto words = line_words(text.substr(begin, end - begin));
    begin = end + 1;
    if (words.empty()) continue;
    if (words[0] == "format" && words.size() > 1) {
      has_format = words[1] == "ascii" || words[1] == "binary_little_endian" || words[1] == "binary_big_endian";
      points.encoding = words[1] == "ascii" ? PcdEncoding::Ascii : PcdEncoding::Binary;
      out.is_big_endian = words[1] == "binary_big_endian";
    } else if (words[0] == "element" && words.size() == 3) {
      std::size_t count = 0;
      if (!read_number(words[2], count)) return wrong("PLY: an element without a number");
      element = words[1];
      if (element == "vertex") {
        points.points = count;
        has_vertices = true;
      } else if (!has_vertices && count > 0) {
        return unsupported("the vertices of this PLY are not its first element: write them first");
      }
    } else if (words[0] == "property" && element == "vertex") {
      if (words.size() != 3) return unsupported("the vertices of this PLY have lists: write them without");
      const PlyType* type = find_ply_type(words[1]);
      if (!type) return wrong(fmt::format("PLY property of unknown type '{}'", words[1]));
      if (points.fields.size() == kMostPcdColumns)
        return unsupported("the vertices of this PLY have too many properties");
      points.fields.emplace_back(words[2]);
      points.types.push_back(type->type.kind);
      points.sizes.push_back(type->type.size);
      points.counts.push_back(1);
    } else if (words[0] == "end_header") {
      if (!has_format) return wrong("PLY: neither ascii nor binary");
      if (!has_vertices || points.fields.empty()) return wrong("this PLY has no vertices");
      points.data_begin = begin;
      return out;
    }
  }
  return wrong("the header of this PLY has no end_header");
}

/// Returns the bytes with the numbers of all whole points turned round.
std::vector<std::byte> turned(const PcdHeader& header, std::span<const std::byte> bytes) {
  std::vector<std::byte> out(bytes.begin(), bytes.end());
  const std::size_t record = header.record_bytes();
  for (std::size_t at = header.data_begin; at + record <= out.size();)
    for (const std::size_t size : header.sizes) {
      std::reverse(out.data() + at, out.data() + at + size);
      at += size;
    }
  return out;
}

/// Returns whether these are rows of 5 numbers whose last is a ring.
bool has_rings(std::span<const float> values) {
  if (values.empty() || values.size() % 5 != 0) return false;
  for (std::size_t i = 4; i < values.size(); i += 5)
    if (!(values[i] >= 0 && values[i] <= 255 && values[i] == std::floor(values[i]))) return false;
  return true;
}

/// Returns the median change from a value to that of the same column in the next row, if rows have this length. Zeros,
/// with which organised clouds fill what did not return, are left out.
float row_change(std::span<const float> values, std::size_t length) {
  std::vector<float> changes;
  for (std::size_t i = 0; i + length < values.size(); ++i)
    if (const float change = std::abs(values[i + length] - values[i]); change > 0) changes.push_back(change);
  if (changes.empty()) return 0;
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::ranges::nth_element(changes, middle);
  return *middle;
}

/// Returns how many numbers a row has: 4, or 5 with rings. It is another number of 3 to 6 if values of one column are
/// then at least twice as similar, because nothing else in the file tells its columns. 0: the values are no such rows.
std::size_t row_length(std::span<const float> values) {
  constexpr std::size_t kLeastValues = 256;  // fewer do not show which are similar
  constexpr std::size_t kMostValues = 1 << 20;
  if (has_rings(values)) return 5;
  std::size_t best = values.size() % 4 == 0 && !values.empty() ? 4 : 0;
  if (values.size() < kLeastValues) return best;
  const auto some = values.first(std::min(values.size(), kMostValues));
  float least = row_change(some, 4) / 2;
  for (const std::size_t length : {3, 5, 6})
    if (values.size() % length == 0)
      if (const float change = row_change(some, length); change < least) {
        least = change;
        best = length;
      }
  return best;
}

/// Returns the header of rows of `columns` floating-point numbers of `size` bytes, in a file that names no columns.
PcdHeader header_of_rows(std::size_t columns, std::size_t size) {
  PcdHeader header;
  header.encoding = PcdEncoding::Binary;
  header.fields = {"x", "y", "z", "intensity"};
  header.fields.resize(std::min(columns, header.fields.size()));
  while (header.fields.size() < columns) header.fields.push_back(fmt::format("column_{}", header.fields.size() + 1));
  header.sizes.assign(columns, size);
  header.counts.assign(columns, 1);
  header.types.assign(columns, 'F');
  return header;
}

Result<PcdCloud> read_las_cloud(const std::string& path) {
  auto reader = LasReader::open(path);
  if (!reader.ok()) return reader.error();
  const bool has_time = reader->header().point_format != 0 && reader->header().point_format != 2;
  PcdCloud cloud;
  cloud.fields = {"x", "y", "z", "intensity"};
  cloud.types = {{'F', 8}, {'F', 8}, {'F', 8}, {'U', 2}};
  if (has_time) {
    cloud.fields.emplace_back("gps_time");
    cloud.types.push_back({'F', 8});
  }
  cloud.columns.resize(cloud.fields.size());
  std::vector<LasPoint> points;
  for (;;) {
    if (Status read = reader->next(points); !read.ok()) return read.error();
    if (points.empty()) return cloud;
    if (cloud.points() > kMostCloudValues / cloud.columns.size()) return too_many_cloud_values(path);
    for (const LasPoint& point : points) {
      const std::array values{point.x, point.y, point.z, double{static_cast<double>(point.intensity)},
                              point.time.value_or(0)};
      for (std::size_t i = 0; i < cloud.columns.size(); ++i) cloud.columns[i].push_back(values[i]);
    }
  }
}

}  // namespace

bool is_ply(std::string_view first_bytes) {
  constexpr std::string_view kWord = "ply";
  return first_bytes.starts_with(kWord) && first_bytes.find_first_of(" \t\r\n") == kWord.size();
}

Result<PcdCloud> decode_ply(std::span<const std::byte> bytes, const std::string& name) {
  const auto header = read_ply_header({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
  if (!header.ok()) return header.error();
  if (!header->is_big_endian) return decode_points(header->points, bytes, name);
  return decode_points(header->points, turned(header->points, bytes), name);
}

Result<PcdCloud> decode_float_rows(std::span<const std::byte> bytes, const std::string& name) {
  std::vector<float> values(bytes.size() / sizeof(float));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
  const std::size_t columns = bytes.size() % sizeof(float) == 0 ? row_length(values) : 0;
  if (columns == 0)
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: its {} bytes are no rows of 3 to 6 float32 (x, y, z, intensity, "
                             "ring or others)",
                             name, bytes.size())};
  PcdHeader header = header_of_rows(columns, sizeof(float));
  if (has_rings(values)) header.fields[4] = "ring";
  header.points = values.size() / columns;
  for (std::size_t i = 0; i < values.size(); i += columns)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!(std::abs(values[i + axis]) <= kFarthest_m))
        return Error{ErrorCode::Malformed,
                     fmt::format("{}: row {} of its float32 is no place: {:g} m", name, i / columns, values[i + axis])};
  return decode_points(header, bytes, name);
}

Result<PcdCloud> decode_npy(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kLead = 10, kFewest = 3;
  constexpr std::size_t kMost = 32;  // columns; an array with more is no list of points
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto wrong = [&](const char* what) { return Error{ErrorCode::Malformed, fmt::format("{}: {}", name, what)}; };
  if (text.size() < kLead + 2 || !text.starts_with(kNpy)) return wrong("no NumPy array, or cut in its header");
  // Version 1 states the length of the header in 2 bytes, later ones in 4.
  const std::size_t width = bytes[6] == std::byte{1} ? 2 : 4;
  std::size_t length = 0;
  for (std::size_t i = 0; i < width; ++i) length += std::to_integer<std::size_t>(bytes[8 + i]) << (8 * i);
  if (length > text.size() - 8 - width) return wrong("cut in the header of a NumPy array");
  const std::string_view header = text.substr(8 + width, length);
  const bool is_float32 = header.find("'<f4'") != std::string_view::npos;
  const std::size_t shape = header.find("'shape': (");
  std::string numbers(shape == std::string_view::npos ? "" : header.substr(shape + 10));
  numbers.erase(std::min(numbers.find(')'), numbers.size()));
  std::ranges::replace(numbers, ',', ' ');
  const auto words = line_words(numbers);
  std::size_t points = 0, columns = 0;
  if ((!is_float32 && header.find("'<f8'") == std::string_view::npos) ||
      header.find("'fortran_order': False") == std::string_view::npos || words.size() != 2 ||
      !read_number(words[0], points) || !read_number(words[1], columns) || columns < kFewest || columns > kMost)
    return Error{
        ErrorCode::Unsupported,
        fmt::format("{}: a NumPy array of this kind is not read: {}; a row for each point is wanted, x, y, z and "
                    "what follows, of float32 or float64 in C's order",
                    name, header.substr(0, std::min(header.find_last_not_of(" \n") + 1, std::size_t{200})))};
  PcdHeader table = header_of_rows(columns, is_float32 ? sizeof(float) : sizeof(double));
  table.points = points;
  table.data_begin = 8 + width + length;
  return decode_points(table, bytes, name);
}

Result<PcdCloud> read_cloud(const std::string& path) {
  std::array<char, kE57Signature.size()> first{};
  {
    const auto file = InputFile::open(path);
    if (!file.ok()) return file.error();
    const std::size_t size = std::min<std::uint64_t>(first.size(), file->size());
    if (Status read = file->read(0, std::as_writable_bytes(std::span(first).first(size))); !read.ok())
      return read.error();
  }
  const std::string_view beginning(first.data(), first.size());
  if (beginning.starts_with("LASF")) return read_las_cloud(path);
  if (beginning == kE57Signature) return read_e57_cloud(path);
  const Result<std::string> text = read_input(path, kMostCloudBytes, "a cloud that has to be whole in memory,");
  if (!text.ok()) return text.error();
  const auto bytes = std::as_bytes(std::span(*text));
  if (is_ply(beginning)) return decode_ply(bytes, path);
  if (std::string_view(*text).starts_with(kNpy)) return decode_npy(bytes, path);
  if (path.ends_with(".bin")) return decode_float_rows(bytes, path);
  if (is_ptx(*text)) return decode_ptx(*text, path, PtxFrame::Scanner);
  if (!text_cloud_kind(*text).empty()) return decode_text_cloud(*text, path);
  return decode_pcd(bytes, path);
}

}  // namespace hueline::storage
