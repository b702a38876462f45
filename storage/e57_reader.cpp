#include "storage/e57_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/number_word.hpp"
#include "core/portable_math.hpp"
#include "storage/xml_element.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint64_t kMostDescription = 256u << 20;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

/// Returns a number of the description: where the standard leaves it out it is `otherwise`. Nothing if it is none.
template <class T>
std::optional<T> number_in(std::string_view text, T otherwise) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  return text.empty() ? std::optional(otherwise) : parse_number<T>(text);
}

std::string_view child_text(const XmlElement& parent, std::string_view child) {
  const XmlElement* found = parent.child(child);
  return found ? trimmed(found->text) : std::string_view();
}

/// Returns the number in a child; 0 if it is missing or no number.
double number_of(const XmlElement* parent, std::string_view child, double otherwise = 0) {
  return parent ? number_in<double>(child_text(*parent, child), otherwise).value_or(otherwise) : otherwise;
}

/// Reads the type of a field. Error: Malformed, Unsupported, with what is wrong.
Result<E57Column> column_from(const XmlElement& field) {
  E57Column out;
  out.name = field.name;
  const std::string_view type = field.attribute("type");
  const auto wrong = [&](const char* what) {
    return Error{ErrorCode::Malformed, fmt::format("its field {} has {}", field.name, what)};
  };
  if (type == "Float") {
    const bool is_single = field.attribute("precision") == "single";
    out.kind = is_single ? E57Column::Kind::Float32 : E57Column::Kind::Float64;
    out.bits = is_single ? 32 : 64;
    return out;
  }
  if (type != "Integer" && type != "ScaledInteger")
    return Error{ErrorCode::Unsupported, fmt::format("its field {} is of type {}; numbers are read", field.name, type)};
  using Limits = std::numeric_limits<std::int64_t>;
  const auto minimum = number_in<std::int64_t>(field.attribute("minimum"), Limits::min());
  const auto maximum = number_in<std::int64_t>(field.attribute("maximum"), Limits::max());
  if (!minimum || !maximum || *minimum > *maximum) return wrong("no least and largest integer");
  out.kind = E57Column::Kind::Integer;
  out.minimum = *minimum;
  out.maximum = *maximum;
  out.bits = static_cast<unsigned>(
      std::bit_width(static_cast<std::uint64_t>(*maximum) - static_cast<std::uint64_t>(*minimum)));
  if (type == "Integer") return out;
  const auto scale = number_in<double>(field.attribute("scale"), 1);
  const auto offset = number_in<double>(field.attribute("offset"), 0);
  if (!scale || !offset) return wrong("no scale and offset");
  out.scale = *scale;
  out.offset = *offset;
  return out;
}

Transform<E57World, Scanner> pose_from(const XmlElement* pose) {
  Transform<E57World, Scanner> out;
  if (!pose) return out;
  const XmlElement* place = pose->child("translation");
  out.translation = {number_of(place, "x"), number_of(place, "y"), number_of(place, "z")};
  if (const XmlElement* turn = pose->child("rotation")) {
    const Eigen::Quaterniond q(number_of(turn, "w"), number_of(turn, "x"), number_of(turn, "y"), number_of(turn, "z"));
    if (q.norm() > 0) out.rotation = q.normalized();
  }
  return out;
}

/// Reads what the description says of a scan.
Result<E57Scan> scan_from(const XmlElement& data) {
  E57Scan out;
  out.name = child_text(data, "name");
  for (const char* part : {"sensorVendor", "sensorModel", "sensorSerialNumber"})
    if (const std::string_view word = child_text(data, part); !word.empty())
      out.sensor += (out.sensor.empty() ? "" : " ") + std::string(word);
  out.T_world_scanner = pose_from(data.child("pose"));
  if (const XmlElement* start = data.child("acquisitionStart")) {
    constexpr double kMostSeconds = 9e9;  // what nanoseconds of 64 bits hold
    const double gps_s = number_of(start, "dateTimeValue");
    if (gps_s > 0 && gps_s < kMostSeconds) out.begin = gps_time_ns(std::llround(gps_s * 1e9));
  }
  const XmlElement* points = data.child("points");
  if (!points) return out;
  const auto count = number_in<std::uint64_t>(points->attribute("recordCount"), 0);
  const auto section = number_in<std::uint64_t>(points->attribute("fileOffset"), 0);
  const XmlElement* prototype = points->child("prototype");
  if (!count || !section || !prototype)
    return Error{ErrorCode::Malformed, "it does not say where its points are, how many, and of which fields"};
  out.points = *count;
  out.section = *section;
  bool has_bits = false;
  for (const XmlElement& field : prototype->children) {
    auto column = column_from(field);
    if (!column.ok()) return column.error();
    has_bits = has_bits || column->bits > 0;
    out.columns.push_back(std::move(*column));
  }
  if (out.points > 0 && !has_bits)
    return Error{ErrorCode::Malformed,
                 "all its points are the same by its description, which has no field that varies"};
  return out;
}

/// Returns the bits of a value that begins at a bit of a stream, which is long enough.
std::uint64_t packed_bits(ByteView bytes, std::size_t at_bit, unsigned bits) {
  const std::size_t first = at_bit / 8, within = at_bit % 8;
  std::array<std::byte, 16> some{};
  const std::size_t size = std::min<std::size_t>(some.size(), bytes.size() - first);
  std::memcpy(some.data(), bytes.data() + first, size);
  std::uint64_t low = 0, high = 0;
  std::memcpy(&low, some.data(), sizeof low);
  std::memcpy(&high, some.data() + sizeof low, sizeof high);
  const std::uint64_t value = within == 0 ? low : low >> within | high << (64 - within);
  return bits == 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

double value_of(const E57Column& column, std::uint64_t bits) {
  switch (column.kind) {
    case E57Column::Kind::Float32:
      return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    case E57Column::Kind::Float64:
      return std::bit_cast<double>(bits);
    case E57Column::Kind::Integer:
      break;
  }
  const auto whole = static_cast<std::int64_t>(static_cast<std::uint64_t>(column.minimum) + bits);
  return static_cast<double>(whole) * column.scale + column.offset;
}

}  // namespace

std::optional<std::size_t> E57Scan::column(std::string_view wanted) const {
  const auto found = std::ranges::find(columns, wanted, &E57Column::name);
  return found == columns.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - columns.begin()));
}

Result<E57Reader> E57Reader::open(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  const auto wrong = [&](ErrorCode code, const std::string& what) {
    return Error{code, fmt::format("{}: {}", path.string(), what)};
  };
  Bytes head(kE57FileHeader);
  if (file->size() < head.size()) return wrong(ErrorCode::Truncated, "is no whole header of E57");
  if (Status read = file->read(0, head); !read.ok()) return read.error();
  ByteReader in(head);
  const ByteView signature = in.take_bytes(kE57Signature.size());
  if (!std::ranges::equal(signature, as_bytes(kE57Signature))) return wrong(ErrorCode::Malformed, "is not E57");
  const auto version = in.take<std::uint32_t>();
  in.take<std::uint32_t>();
  const auto size = in.take<std::uint64_t>(), place = in.take<std::uint64_t>(), length = in.take<std::uint64_t>(),
             page = in.take<std::uint64_t>();
  if (version != 1) return wrong(ErrorCode::Unsupported, fmt::format("is E57 of version {}; 1 is read", version));
  if (place == 0 || length == 0)
    return wrong(ErrorCode::Malformed,
                 "has no description, because the program that wrote it did not finish: write it again");
  if (page != kE57Page)
    return wrong(ErrorCode::Unsupported, fmt::format("has pages of {} bytes; the standard says {}", page, kE57Page));
  if (file->size() < size || file->size() % kE57Page != 0)
    return wrong(ErrorCode::Truncated,
                 fmt::format("was cut: it has {} of {} bytes, and its description is at its end", file->size(), size));
  if (length > kMostDescription) return wrong(ErrorCode::Unsupported, "has a description of more than 256 MB");

  E57Reader out(E57Pages(std::move(*file)));
  const std::uint64_t begin = e57_place_in_content(place);
  if (begin > out.pages_.size() || length > out.pages_.size() - begin)
    return wrong(ErrorCode::Malformed, "has its description behind its end");
  std::string text(static_cast<std::size_t>(length), '\0');
  if (Status read = out.pages_.read(begin, std::as_writable_bytes(std::span(text))); !read.ok()) return read.error();
  const auto root = parse_xml(text, path.string());
  if (!root.ok()) return root.error();
  out.crs_ = child_text(*root, "coordinateMetadata");
  if (const XmlElement* images = root->child("images2D")) out.images_ = images->children.size();
  const XmlElement* data = root->child("data3D");
  for (std::size_t i = 0; data && i < data->children.size(); ++i) {
    auto scan = scan_from(data->children[i]);
    if (!scan.ok()) return wrong(scan.error().code, fmt::format("scan {}: {}", i, scan.error().message));
    out.scans_.push_back(std::move(*scan));
  }
  return out;
}

Status E57Reader::begin(std::size_t scan) {
  const E57Scan& wanted = scans_[scan];
  scan_ = scan;
  left_ = wanted.points;
  streams_.assign(wanted.columns.size(), {});
  if (left_ == 0) return {};
  const auto wrong = [&](const char* what) {
    left_ = 0;
    return Error{ErrorCode::Malformed, fmt::format("{}: scan {}: {}", name(), scan, what)};
  };
  Bytes head(kE57SectionHeader);
  const std::uint64_t begin = e57_place_in_content(wanted.section);
  if (Status read = pages_.read(begin, head); !read.ok()) {
    left_ = 0;
    return read;
  }
  ByteReader in(head);
  if (in.take<std::uint8_t>() != kE57VectorSection)
    return wrong("what it gives as the place of its points is no section of points");
  in.take_bytes(7);
  const auto length = in.take<std::uint64_t>(), data = in.take<std::uint64_t>();
  at_ = e57_place_in_content(data);
  end_ = begin + std::min(length, pages_.size() - begin);
  if (at_ < begin || at_ > end_) return wrong("its points are not in their section");
  return {};
}

std::size_t E57Reader::whole_values() const {
  const E57Scan& scan = scans_[scan_];
  std::size_t out = std::numeric_limits<std::size_t>::max();
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (const unsigned bits = scan.columns[i].bits; bits > 0)
      out = std::min(out, (8 * streams_[i].bytes.size() - streams_[i].at_bit) / bits);
  return out;
}

Status E57Reader::read_packet() {
  const auto wrong = [&](ErrorCode code, const std::string& what) {
    return Error{code, fmt::format("{}: scan {}: {}; {} of its {} points were read", name(), scan_, what,
                                   scans_[scan_].points - left_, scans_[scan_].points)};
  };
  for (;;) {
    if (at_ + kE57PacketHead > end_) return wrong(ErrorCode::Truncated, "its section ends before its last point");
    Bytes packet(kE57PacketHead);
    if (Status read = pages_.read(at_, packet); !read.ok()) return wrong(read.error().code, read.error().message);
    ByteReader head(packet);
    const auto kind = head.take<std::uint8_t>();
    head.take<std::uint8_t>();
    const std::size_t size = std::size_t{head.take<std::uint16_t>()} + 1;
    const std::size_t streams = head.take<std::uint16_t>();
    if (size < kE57PacketHead || size % 4 != 0 || at_ + size > end_)
      return wrong(ErrorCode::Malformed, fmt::format("a packet of {} bytes at byte {}", size, e57_place_in_file(at_)));
    if (kind != kE57DataPacket) {  // an index, or room that is kept free
      at_ += size;
      continue;
    }
    packet.resize(size);
    if (Status read = pages_.read(at_, packet); !read.ok()) return wrong(read.error().code, read.error().message);
    const auto damaged = [&] {
      return wrong(ErrorCode::Malformed, fmt::format("a packet whose streams are not those of its fields, at byte {}",
                                                     e57_place_in_file(at_)));
    };
    if (streams != streams_.size()) return damaged();
    ByteReader in{ByteView(packet).subspan(kE57PacketHead)};
    std::vector<std::uint16_t> lengths(streams);
    for (std::uint16_t& length : lengths) length = in.take<std::uint16_t>();
    for (std::size_t i = 0; i < streams; ++i) {
      Stream& stream = streams_[i];
      const std::size_t used = stream.at_bit / 8;
      stream.bytes.erase(stream.bytes.begin(), stream.bytes.begin() + static_cast<std::ptrdiff_t>(used));
      stream.at_bit -= 8 * used;
      append(stream.bytes, in.take_bytes(lengths[i]));
    }
    if (!in.ok()) return damaged();
    at_ += size;
    return {};
  }
}

Status E57Reader::next(std::vector<std::vector<double>>& columns, std::size_t most) {
  columns.resize(streams_.size());
  for (std::vector<double>& column : columns) column.clear();
  if (left_ == 0) return {};
  while (whole_values() == 0)
    if (Status read = read_packet(); !read.ok()) {
      left_ = 0;
      return read;
    }
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>({whole_values(), most, left_}));
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const E57Column& column = scans_[scan_].columns[i];
    Stream& stream = streams_[i];
    columns[i].reserve(count);
    for (std::size_t k = 0; k < count; ++k, stream.at_bit += column.bits)
      columns[i].push_back(
          value_of(column, column.bits == 0 ? 0 : packed_bits(stream.bytes, stream.at_bit, column.bits)));
  }
  left_ -= count;
  return {};
}

void e57_places(const E57Scan& scan, const std::vector<std::vector<double>>& columns,
                std::vector<Point<Scanner>>& places) {
  const std::size_t count = columns.empty() ? 0 : columns.front().size();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  places.assign(count, {{kNaN, kNaN, kNaN}});
  const auto wanted = [&](std::array<const char*, 3> names) {
    std::array<const std::vector<double>*, 3> out{};
    for (std::size_t i = 0; i < out.size(); ++i)
      if (const auto at = scan.column(names[i])) out[i] = &columns[*at];
    return out;
  };
  const auto has_all = [](const auto& some) { return std::ranges::all_of(some, [](const auto* one) { return one; }); };
  const auto xyz = wanted({"cartesianX", "cartesianY", "cartesianZ"});
  const auto ball = wanted({"sphericalRange", "sphericalAzimuth", "sphericalElevation"});
  const bool is_cartesian = has_all(xyz);
  if (!is_cartesian && !has_all(ball)) return;
  // 1: the direction is known and the distance is not; 2: neither is.
  const auto state = scan.column(is_cartesian ? "cartesianInvalidState" : "sphericalInvalidState");
  for (std::size_t i = 0; i < count; ++i) {
    if (state && columns[*state][i] != 0) continue;
    if (is_cartesian) {
      places[i].xyz = {(*xyz[0])[i], (*xyz[1])[i], (*xyz[2])[i]};
      continue;
    }
    const double range = (*ball[0])[i], azimuth = (*ball[1])[i], elevation = (*ball[2])[i];
    const double level = range * portable::cos(elevation);
    places[i].xyz = {level * portable::cos(azimuth), level * portable::sin(azimuth), range * portable::sin(elevation)};
  }
}

}  // namespace hueline::storage
