#include "storage/las_reader.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace hueline::storage {
namespace {

constexpr int kLargestFormat = 8;

template <class T>
T at(ByteView record, std::size_t offset) {
  T value;
  std::memcpy(&value, record.data() + offset, sizeof value);
  return value;
}

/// Where time and colour begin in the record of a point format; 0 if it has none.
struct Layout {
  std::size_t time, colour;
};
constexpr Layout kLayouts[] = {{0, 0}, {20, 0}, {0, 20}, {20, 28}, {20, 0}, {20, 28}, {22, 0}, {22, 30}, {22, 30}};

}  // namespace

Result<LasReader> LasReader::open(const std::filesystem::path& path) {
  Result<InputFile> file = InputFile::open(path);
  if (!file) return file.error();
  LasReader reader(std::move(*file));
  if (Status read = reader.read_records(); !read) {
    Error error = read.error();
    if (error.code != ErrorCode::Io) error.message = path.string() + ": " + error.message;
    return error;
  }
  return reader;
}

Status LasReader::read_records() {
  Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(kLasHeaderSize14, file_.size())));
  if (Status done = file_.read(0, head); !done) return done;
  Result<LasHeader> header = decode_las_header(head);
  if (!header) return header.error();
  header_ = *header;
  if (header_.point_format & 0x80)
    return Error{ErrorCode::Unsupported, "the points are compressed (LAZ): unpack them first"};
  if (header_.point_format > kLargestFormat)
    return Error{ErrorCode::Unsupported, "point format " + std::to_string(header_.point_format) + ": 0 to 8 are read"};
  const std::size_t least = las_point_size(header_.point_format);
  if (header_.point_size < least)
    return Error{ErrorCode::Malformed, "points of " + std::to_string(header_.point_size) + " bytes: format " +
                                           std::to_string(header_.point_format) + " needs " + std::to_string(least)};
  if (header_.point_offset > file_.size()) return Error{ErrorCode::Truncated, "the file ends before its first point"};
  available_ = std::min(header_.point_count, (file_.size() - header_.point_offset) / header_.point_size);

  std::uint64_t offset = header_.header_size;
  for (std::uint32_t i = 0; i < header_.vlr_count; ++i) {
    Bytes vlr_head(kLasVlrHead);
    if (offset + kLasVlrHead > header_.point_offset)
      return Error{ErrorCode::Malformed, "variable length record " + std::to_string(i) + " reaches into the points"};
    if (Status done = file_.read(offset, vlr_head); !done) return done;
    ByteReader in(vlr_head);
    in.take<std::uint16_t>();
    const auto text = [&in](std::size_t width) {
      const ByteView bytes = in.take_bytes(width);
      const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      return std::string(all.substr(0, all.find('\0')));
    };
    LasVlr vlr;
    vlr.user_id = text(16);
    vlr.record_id = in.take<std::uint16_t>();
    const std::size_t size = in.take<std::uint16_t>();
    vlr.description = text(32);
    offset += kLasVlrHead;
    if (offset + size > header_.point_offset)
      return Error{ErrorCode::Malformed, "variable length record " + std::to_string(i) + " reaches into the points"};
    vlr.data.resize(size);
    if (Status done = file_.read(offset, std::as_writable_bytes(std::span(vlr.data))); !done) return done;
    offset += size;
    if (vlr.user_id == "LASF_Spec" && vlr.record_id == 4) {
      extra_ = decode_extra_fields(as_bytes(vlr.data), least);
      std::erase_if(extra_, [&](const auto& f) { return f.offset + size_of(f.type) > header_.point_size; });
    }
    vlrs_.push_back(std::move(vlr));
  }
  return {};
}

const LasExtraField* LasReader::extra_field(std::string_view name) const {
  const auto found = std::find_if(extra_.begin(), extra_.end(), [&](const auto& f) { return f.name == name; });
  return found == extra_.end() ? nullptr : &*found;
}

std::string LasReader::wkt() const {
  for (const LasVlr& vlr : vlrs_)
    if (vlr.user_id == "LASF_Projection" && vlr.record_id == 2112) return vlr.data.substr(0, vlr.data.find('\0'));
  return {};
}

bool LasReader::has_colour() const { return kLayouts[header_.point_format].colour != 0; }

std::optional<GpsTime> LasReader::gps_time(const LasPoint& point) const {
  if (!point.time || !(header_.global_encoding & kLasAdjustedTime)) return {};
  return from_las_time(*point.time);
}

double LasReader::extra(const LasPoint& point, const LasExtraField& field) {
  const auto value = [&]() -> double {
    const ByteView r = point.record;
    switch (field.type) {
      case LasType::U8:
        return at<std::uint8_t>(r, field.offset);
      case LasType::I8:
        return at<std::int8_t>(r, field.offset);
      case LasType::U16:
        return at<std::uint16_t>(r, field.offset);
      case LasType::I16:
        return at<std::int16_t>(r, field.offset);
      case LasType::U32:
        return at<std::uint32_t>(r, field.offset);
      case LasType::I32:
        return at<std::int32_t>(r, field.offset);
      case LasType::U64:
        return static_cast<double>(at<std::uint64_t>(r, field.offset));
      case LasType::I64:
        return static_cast<double>(at<std::int64_t>(r, field.offset));
      case LasType::F32:
        return at<float>(r, field.offset);
      case LasType::F64:
        return at<double>(r, field.offset);
    }
    return 0;
  };
  if (field.offset + size_of(field.type) > point.record.size()) return 0;
  return field.has_scale ? value() * field.scale + field.shift : value();
}

void LasReader::decode(ByteView r, LasPoint& p) const {
  p = {};
  p.record = r;
  p.x = at<std::int32_t>(r, 0) * header_.scale[0] + header_.offset[0];
  p.y = at<std::int32_t>(r, 4) * header_.scale[1] + header_.offset[1];
  p.z = at<std::int32_t>(r, 8) * header_.scale[2] + header_.offset[2];
  p.intensity = at<std::uint16_t>(r, 12);
  const auto flags = at<std::uint8_t>(r, 14);
  if (header_.point_format < 6) {
    p.return_number = flags & 7;
    p.return_count = (flags >> 3) & 7;
    p.classification = at<std::uint8_t>(r, 15) & 31;
    p.scan_angle_deg = at<std::int8_t>(r, 16);
    p.user_data = at<std::uint8_t>(r, 17);
    p.source = at<std::uint16_t>(r, 18);
  } else {
    p.return_number = flags & 15;
    p.return_count = flags >> 4;
    p.classification = at<std::uint8_t>(r, 16);
    p.user_data = at<std::uint8_t>(r, 17);
    p.scan_angle_deg = at<std::int16_t>(r, 18) * 0.006;
    p.source = at<std::uint16_t>(r, 20);
  }
  const Layout layout = kLayouts[header_.point_format];
  if (layout.time) p.time = at<double>(r, layout.time);
  if (layout.colour) {
    p.red = at<std::uint16_t>(r, layout.colour);
    p.green = at<std::uint16_t>(r, layout.colour + 2);
    p.blue = at<std::uint16_t>(r, layout.colour + 4);
  }
}

Status LasReader::next(std::vector<LasPoint>& out, std::size_t most) {
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(most, available_ - read_));
  out.clear();
  if (count == 0) {
    if (available_ == header_.point_count || most == 0) return {};
    return Error{ErrorCode::Truncated, file_.path().string() + " ends at byte " + std::to_string(file_.size()) +
                                           ": it holds " + std::to_string(available_) + " of the " +
                                           std::to_string(header_.point_count) + " points that its header counts"};
  }
  buffer_.resize(count * header_.point_size);
  if (Status done = file_.read(header_.point_offset + read_ * header_.point_size, buffer_); !done) return done;
  read_ += count;
  out.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    decode(ByteView(buffer_).subspan(i * header_.point_size, header_.point_size), out[i]);
  return {};
}

}  // namespace hueline::storage
