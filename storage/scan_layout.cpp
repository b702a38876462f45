#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "core/line_words.hpp"
#include "core/number_word.hpp"
#include "storage/e57_pages.hpp"
#include "storage/las_format.hpp"
#include "storage/pcd_header.hpp"
#include "storage/scan_file.hpp"

namespace hueline::storage {
namespace {

constexpr std::size_t kMostHeader = 64 * 1024;

Error unsupported(const InputFile& file, const std::string& what) {
  return {ErrorCode::Unsupported, file.path().string() + ": " + what};
}
Error malformed(const InputFile& file, const std::string& what) {
  return {ErrorCode::Malformed, file.path().string() + ": " + what};
}

Result<ScanLayout> las_layout(const InputFile& file, ByteView head) {
  const auto header = decode_las_header(head.first(std::min(head.size(), kLasHeaderSize14)));
  if (!header.ok()) return malformed(file, header.error().message);
  if (header->point_format & 0x80) return unsupported(file, "the points are compressed (LAZ): unpack them first");
  const std::size_t least = las_point_size(header->point_format);
  if (least == 0)
    return unsupported(file, fmt::format("its LAS point format is {}; formats 0 to 10 are read", header->point_format));
  if (header->point_size < least)
    return malformed(file, fmt::format("its points have {} bytes, but format {} needs {}", header->point_size,
                                       header->point_format, least));
  ScanLayout layout;
  layout.format = ScanFormat::Las;
  layout.words = fmt::format("LAS 1.{}, point format {}", header->version_minor, header->point_format);
  layout.begin = header->point_offset;
  layout.points = header->point_count;
  layout.record_size = header->point_size;
  layout.number = ScanLayout::Number::ScaledInt32;
  layout.scale = header->scale;
  layout.offset = header->offset;
  return layout;
}

std::size_t ply_size(std::string_view type) {
  for (const auto& [size, names] : {std::pair<std::size_t, std::string_view>{1, " char uchar int8 uint8 "},
                                    {2, " short ushort int16 uint16 "},
                                    {4, " int uint int32 uint32 float float32 "},
                                    {8, " double float64 "}})
    if (names.find(fmt::format(" {} ", type)) != std::string_view::npos) return size;
  return 0;
}

Result<ScanLayout> ply_layout(const InputFile& file, std::string_view text) {
  ScanLayout layout;
  layout.format = ScanFormat::Ply;
  std::string encoding, number;
  bool in_vertex = false, seen_vertex = false, has_more = false;
  std::size_t record = 0, columns = 0, axes = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    const auto words = line_words(text.substr(begin, end - begin));
    begin = end + 1;
    if (words.empty()) continue;
    if (words[0] == "format" && words.size() >= 2) encoding = words[1];
    if (words[0] == "element" && words.size() == 3) {
      std::uint64_t count = 0;
      if (!read_number(words[2], count))
        return malformed(file, fmt::format("PLY: '{}' is no number of elements", words[2]));
      in_vertex = words[1] == "vertex";
      if (in_vertex && has_more)
        return unsupported(file, "the vertices of this PLY are not its first element: write them first");
      if (in_vertex) {
        seen_vertex = true;
        layout.points = count;
      } else if (count > 0) {
        has_more = true;
      }
    }
    if (words[0] == "property" && in_vertex) {
      if (words.size() != 3) return unsupported(file, "the vertices of this PLY have lists: write them without");
      const std::size_t size = ply_size(words[1]);
      if (size == 0) return malformed(file, fmt::format("PLY property of unknown type '{}'", words[1]));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (words[2] != std::string_view("xyz").substr(axis, 1)) continue;
        const bool is_double = words[1] == "double" || words[1] == "float64";
        if (!is_double && words[1] != "float" && words[1] != "float32")
          return unsupported(file,
                             fmt::format("its PLY coordinates are of type {}; float and double are read", words[1]));
        if (!number.empty() && number != words[1])
          return unsupported(file, "its PLY coordinates have different types: write all as float or all as double");
        number = words[1];
        layout.number = is_double ? ScanLayout::Number::Float64 : ScanLayout::Number::Float32;
        layout.place[axis] = encoding == "ascii" ? columns : record;
        ++axes;
      }
      record += size;
      ++columns;
    }
    if (words[0] != "end_header") continue;
    if (!seen_vertex || axes != 3) return malformed(file, "this PLY has no vertices with x, y and z");
    layout.begin = begin;
    layout.record_size = record;
    layout.is_text = encoding == "ascii";
    layout.is_big_endian = encoding == "binary_big_endian";
    if (!layout.is_text && !layout.is_big_endian && encoding != "binary_little_endian")
      return malformed(file, fmt::format("unknown PLY format '{}'", encoding));
    if (layout.is_text && has_more)
      return unsupported(file,
                         "this ascii PLY has faces or other elements: write the vertices alone, or a binary file");
    layout.words = fmt::format("PLY {}, {} x y z", encoding, number);
    return layout;
  }
  return malformed(file, "the header of this PLY has no end_header");
}

Result<ScanLayout> pcd_layout(const InputFile& file, std::string_view text) {
  const auto header = read_pcd_header(text, file.path().string());
  if (!header.ok()) return header.error();
  ScanLayout layout;
  layout.format = ScanFormat::Pcd;
  layout.begin = header->data_begin;
  layout.points = header->points;
  layout.record_size = header->record_bytes();
  layout.is_text = header->encoding == PcdEncoding::Ascii;
  std::size_t column = 0, offset = 0, axes = 0, size = 0;
  for (std::size_t f = 0; f < header->fields.size(); ++f) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (header->fields[f] != std::string_view("xyz").substr(axis, 1)) continue;
      if (header->types[f] != 'F' || (size != 0 && size != header->sizes[f]))
        return unsupported(file, "its PCD coordinates are not all float or all double");
      size = header->sizes[f];
      layout.place[axis] = layout.is_text ? column : offset;
      ++axes;
    }
    column += header->counts[f];
    offset += header->sizes[f] * header->counts[f];
  }
  if (axes != 3) return malformed(file, "this PCD has no fields x, y and z");
  layout.number = size == 8 ? ScanLayout::Number::Float64 : ScanLayout::Number::Float32;
  layout.words = fmt::format("PCD {}, {} x y z",
                             header->encoding == PcdEncoding::Ascii    ? "ascii"
                             : header->encoding == PcdEncoding::Binary ? "binary"
                                                                       : "binary_compressed",
                             size == 8 ? "double" : "float");
  if (header->encoding == PcdEncoding::Compressed) layout.record_size = 0;  // compressed columns, no records
  return layout;
}

}  // namespace

const char* name(ScanFormat format) {
  switch (format) {
    case ScanFormat::Las:
      return "las";
    case ScanFormat::Ply:
      return "ply";
    case ScanFormat::Pcd:
      return "pcd";
    case ScanFormat::E57:
      return "e57";
    case ScanFormat::Text:
      return "xyz";
    case ScanFormat::Float32:
      return "float32";
  }
  return "?";
}

std::optional<ScanFormat> scan_format(const std::string& wanted) {
  for (const ScanFormat format :
       {ScanFormat::Las, ScanFormat::Ply, ScanFormat::Pcd, ScanFormat::E57, ScanFormat::Text, ScanFormat::Float32})
    if (wanted == name(format)) return format;
  return {};
}

Result<ScanLayout> read_scan_layout(const InputFile& file, std::optional<ScanFormat> format) {
  std::vector<std::byte> head(static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), kMostHeader)));
  if (Status done = file.read(0, head); !done.ok()) return done.error();
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  std::string extension = file.path().extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (!format) {
    if (text.starts_with("LASF"))
      format = ScanFormat::Las;
    else if (text.starts_with("ply\n") || text.starts_with("ply\r"))
      format = ScanFormat::Ply;
    else if (text.starts_with("# .PCD") || text.starts_with("VERSION") || text.starts_with("FIELDS"))
      format = ScanFormat::Pcd;
    else if (text.starts_with(kE57Signature))
      format = ScanFormat::E57;
    else if (extension == ".f32" || extension == ".raw" || extension == ".bin")
      format = ScanFormat::Float32;
    else if (extension == ".xyz" || extension == ".txt" || extension == ".asc" || extension == ".csv")
      format = ScanFormat::Text;
    else
      return unsupported(
          file,
          "its format is not known by its first bytes or its name; give --format las, ply, pcd, e57, xyz or float32");
  }
  if (*format == ScanFormat::Las) return las_layout(file, head);
  if (*format == ScanFormat::Ply) return ply_layout(file, text);
  if (*format == ScanFormat::Pcd) return pcd_layout(file, text);
  ScanLayout layout;
  layout.format = *format;
  if (*format == ScanFormat::E57) {
    layout.words = "E57";
    layout.record_size = 0;  // packed columns
    return layout;
  }
  if (*format == ScanFormat::Text) {
    layout.is_text = true;
    layout.may_have_title = true;
    layout.place = {0, 1, 2};
    layout.words = "text, x y z in its first columns";
    return layout;
  }
  if (file.size() % 12 != 0)
    return malformed(file, fmt::format("{} bytes are no whole number of float32 x y z (12 bytes each)", file.size()));
  layout.points = file.size() / 12;
  layout.words = "float32 x y z, little-endian, no header";
  return layout;
}

}  // namespace hueline::storage
