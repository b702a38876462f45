#include "storage/las_reader.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/printable.hpp"
#include "storage/laz_format.hpp"

namespace hueline::storage {
namespace {

constexpr int kLargestFormat = 10;

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
constexpr Layout kLayouts[] = {{0, 0},  {20, 0},  {0, 20},  {20, 28}, {20, 0}, {20, 28},
                               {22, 0}, {22, 30}, {22, 30}, {22, 0},  {22, 30}};

/// Reads the head of a record; `Size` is the type of the size of its data.
template <class Size>
std::pair<LasVlr, std::uint64_t> take_head(ByteView head) {
  ByteReader in(head);
  in.take<std::uint16_t>();
  const auto text = [&in](std::size_t width) {
    const ByteView bytes = in.take_bytes(width);
    const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return std::string(all.substr(0, all.find('\0')));
  };
  LasVlr vlr;
  vlr.user_id = text(16);
  vlr.record_id = in.take<std::uint16_t>();
  const auto size = in.take<Size>();
  vlr.description = text(32);
  return {std::move(vlr), size};
}

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
  if (file_.size() == 0)
    return Error{ErrorCode::Malformed, "the file is empty: the run that was to make the cloud placed no point"};
  Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(kLasHeaderSize14, file_.size())));
  if (Status done = file_.read(0, head); !done) return done;
  Result<LasHeader> header = decode_las_header(head);
  if (!header) return header.error();
  header_ = *header;
  constexpr double kFarthest = 1e15, kSteps = 2147483648.0;
  for (std::size_t k = 0; k < 3; ++k)
    if (!(header_.scale[k] != 0 && std::abs(header_.scale[k]) * kSteps + std::abs(header_.offset[k]) < kFarthest))
      return Error{ErrorCode::Malformed, "the scales and offsets in its header make no coordinates"};
  const bool is_compressed = header_.point_format & kLazFlag;
  header_.point_format &= static_cast<std::uint8_t>(~kLazFlag);
  if (header_.point_format > kLargestFormat)
    return Error{ErrorCode::Unsupported, "point format " + std::to_string(header_.point_format) + ": 0 to 10 are read"};
  const std::size_t least = las_point_size(header_.point_format);
  if (header_.point_size < least)
    return Error{ErrorCode::Malformed, "points of " + std::to_string(header_.point_size) + " bytes: format " +
                                           std::to_string(header_.point_format) + " needs " + std::to_string(least)};
  if (header_.point_offset > file_.size()) return Error{ErrorCode::Truncated, "the file ends before its first point"};
  if (!is_compressed)
    available_ = std::min(header_.point_count, (file_.size() - header_.point_offset) / header_.point_size);

  std::uint64_t offset = header_.header_size;
  for (std::uint32_t i = 0; i < header_.vlr_count; ++i) {
    const std::string number = std::to_string(i);
    const Error beyond{ErrorCode::Malformed, "variable length record " + number + " reaches into the points"};
    if (offset + kLasVlrHead > header_.point_offset) return beyond;
    Bytes vlr_head(kLasVlrHead);
    if (Status done = file_.read(offset, vlr_head); !done) return done;
    offset += kLasVlrHead;
    auto [vlr, size] = take_head<std::uint16_t>(vlr_head);
    if (offset + size > header_.point_offset) return beyond;
    if (Status done = read_record(std::move(vlr), offset, static_cast<std::size_t>(size)); !done) return done;
    offset += size;
  }
  if (Status done = read_extended_records(); !done) return done;
  std::string described;
  for (const LasVlr& vlr : vlrs_)
    if (vlr.user_id == "LASF_Spec" && vlr.record_id == 4)
      described += vlr.data.substr(0, vlr.data.size() / kLasExtraDescription * kLasExtraDescription);
  extra_ = decode_extra_fields(as_bytes(described), least);
  std::erase_if(extra_, [&](const auto& f) { return f.offset + size_of(f.type) > header_.point_size; });
  if (!is_compressed) return {};
  const auto laz = std::find_if(vlrs_.begin(), vlrs_.end(), [](const LasVlr& v) {
    return v.user_id == "laszip encoded" && v.record_id == kLazRecord;
  });
  if (laz == vlrs_.end())
    return Error{ErrorCode::Malformed, "the points are compressed, and the LAZ record is missing"};
  return find_chunks(*laz);
}

/// Reads the records behind the points. They may be as large as the points; those that a record in front of the points
/// could not hold are only named.
Status LasReader::read_extended_records() {
  constexpr std::uint64_t kLargest = 0xFFFF;
  std::uint64_t offset = header_.evlr_offset;
  if (offset == 0) return {};
  for (std::uint32_t i = 0; i < header_.evlr_count; ++i) {
    if (offset > file_.size() || file_.size() - offset < kLasEvlrHead) {
      left_out_.push_back("the file ends before extended record " + std::to_string(i) + " of " +
                          std::to_string(header_.evlr_count));
      break;
    }
    Bytes head(kLasEvlrHead);
    if (Status done = file_.read(offset, head); !done) return done;
    offset += kLasEvlrHead;
    auto [vlr, size] = take_head<std::uint64_t>(head);
    const bool is_whole = size <= file_.size() - offset;
    const std::string name = printable(vlr.user_id) + "/" + std::to_string(vlr.record_id);
    if (!is_whole) {
      left_out_.push_back("the file ends inside extended record " + name);
      break;
    }
    if (size <= kLargest) {
      if (Status done = read_record(std::move(vlr), offset, static_cast<std::size_t>(size)); !done) return done;
    } else if (vlr.user_id != "copc") {
      left_out_.push_back("extended record " + name + " of " + std::to_string(size) + " bytes");
    }
    offset += size;
  }
  return {};
}

Status LasReader::read_record(LasVlr vlr, std::uint64_t offset, std::size_t size) {
  vlr.data.resize(size);
  if (Status done = file_.read(offset, std::as_writable_bytes(std::span(vlr.data))); !done) return done;
  vlrs_.push_back(std::move(vlr));
  return {};
}

/// Reads where the chunks are: from the table, or from the chunks themselves if the table is not there.
Status LasReader::find_chunks(const LasVlr& vlr) {
  const LazRecord kind{header_.point_format, header_.point_size};
  if (!is_laz_record(kind))
    return Error{ErrorCode::Unsupported, "compressed points (LAZ) of format " + std::to_string(kind.format) + ": " +
                                             kLazFormats + " are read; unpack the file first"};
  const Result<LazCompression> compression = read_laz_vlr(as_bytes(vlr.data), kind);
  if (!compression) return compression.error();
  chunk_points_ = compression->chunk_points;
  item_version_ = compression->item_version;
  const std::uint64_t begin = header_.point_offset + sizeof(std::uint64_t);
  if (begin > file_.size()) return Error{ErrorCode::Truncated, "the file ends before its first point"};
  std::uint64_t place = 0;
  if (Status done = file_.read(header_.point_offset, std::as_writable_bytes(std::span(&place, 1))); !done) return done;
  // A program that could not go back in its file wrote the place of the table at the end.
  if (place == ~std::uint64_t{0} && file_.size() - begin >= sizeof place)
    if (Status done = file_.read(file_.size() - sizeof place, std::as_writable_bytes(std::span(&place, 1))); !done)
      return done;
  const bool has_points = chunk_points_ == kLazVariableChunks;
  bool is_whole = false;
  if (place != header_.point_offset && place < file_.size()) {
    constexpr std::uint64_t kLargestTable = 64 << 20;
    Bytes bytes(static_cast<std::size_t>(std::min(file_.size() - place, kLargestTable)));
    if (Status done = file_.read(place, bytes); !done) return done;
    const auto table = decode_laz_table(bytes, has_points, (file_.size() - begin) / kind.size);
    std::uint64_t at = begin;
    is_whole = table.ok();
    for (std::size_t i = 0; is_whole && i < table->size(); ++i) {
      const LazChunkSize& size = (*table)[i];
      is_whole = size.bytes >= kind.size && size.bytes <= file_.size() - at;
      if (!is_whole) break;
      chunks_.push_back({at, size.bytes, available_, has_points ? size.points : points_at_most(kind)});
      at += size.bytes;
      available_ += chunks_.back().points;
    }
    // The last chunk of equal ones may be smaller; the header's count says it. While the file was written, only whole
    // chunks were counted.
    is_whole = is_whole && available_ >= header_.point_count;
  }
  if (!is_whole)
    if (Status walked = walk_chunks(begin); !walked) return walked;
  available_ = std::min(available_, header_.point_count);
  return {};
}

/// Returns how many points the next chunk may have. Where only the file knows the number of the last one, it is that.
std::uint32_t LasReader::points_at_most(const LazRecord& kind) const {
  if (kind.is_layered()) return chunk_points_;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(chunk_points_, header_.point_count - std::min(available_, header_.point_count)));
}

Status LasReader::walk_chunks(std::uint64_t at) {
  const LazRecord kind{header_.point_format, header_.point_size};
  chunks_.clear();
  available_ = 0;
  if (!kind.is_layered()) return walk_unmeasured_chunks(at);
  Bytes head(laz_chunk_head(kind));
  while (available_ < header_.point_count && at + head.size() <= file_.size()) {
    if (Status done = file_.read(at, head); !done) return done;
    const LazChunkSize size = measure_laz_chunk(head, kind);
    if (size.points == 0 || size.points > chunk_points_ || size.bytes > file_.size() - at) break;
    chunks_.push_back({at, size.bytes, available_, size.points});
    at += size.bytes;
    available_ += size.points;
  }
  return {};
}

/// Where a chunk ends is known when it is unpacked.
Status LasReader::walk_unmeasured_chunks(std::uint64_t at) {
  const LazRecord kind{header_.point_format, header_.point_size};
  while (chunk_points_ != kLazVariableChunks && available_ < header_.point_count) {
    const std::uint32_t points = points_at_most(kind);
    // Points that compress badly take more than their size: some symbols have 14 bits.
    packed_.resize(static_cast<std::size_t>(std::min(file_.size() - at, std::uint64_t{points} * kind.size * 2 + 64)));
    if (Status done = file_.read(at, packed_); !done) return done;
    const Result<std::size_t> bytes = decode_laz_chunk(packed_, kind, points, unpacked_records_);
    if (!bytes) break;
    chunks_.push_back({at, *bytes, available_, points});
    at += *bytes;
    available_ += points;
  }
  return {};
}

const LasExtraField* LasReader::extra_field(std::string_view name) const {
  const auto found = std::find_if(extra_.begin(), extra_.end(), [&](const auto& f) { return f.name == name; });
  return found == extra_.end() ? nullptr : &*found;
}

std::string LasReader::wkt() const {
  // Before LAS 1.4 had a record for it, libLAS wrote WKT beside the GeoTIFF keys under its own name.
  for (const char* user : {"LASF_Projection", "liblas"})
    for (const LasVlr& vlr : vlrs_)
      if (vlr.user_id == user && vlr.record_id == 2112)
        if (std::string wkt = vlr.data.substr(0, vlr.data.find('\0')); !wkt.empty()) return wkt;
  return {};
}

Result<bool> LasReader::has_byte_colours() {
  std::vector<LasPoint> points;
  bool is_bright = !has_colour();
  while (!is_bright) {
    const Status read = next(points);
    if (!read && read.error().code != ErrorCode::Truncated) return read.error();
    is_bright = std::any_of(points.begin(), points.end(), [](const LasPoint& p) {
      return std::max({p.red, p.green, p.blue}) > 0xFF;
    });
    if (!read || points.empty()) break;
  }
  rewind();
  return !is_bright;
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

/// Puts the next `count` records, which the file has, into the buffer.
Status LasReader::fill(std::size_t count) {
  buffer_.resize(count * header_.point_size);
  if (is_compressed()) return fill_from_chunks(count);
  return file_.read(header_.point_offset + read_ * header_.point_size, buffer_);
}

Status LasReader::fill_from_chunks(std::size_t count) {
  const LazRecord kind{header_.point_format, header_.point_size, item_version_};
  for (std::size_t done = 0; done < count;) {
    const std::uint64_t number = read_ + done;
    const auto after =
        std::upper_bound(chunks_.begin(), chunks_.end(), number, [](auto n, const Chunk& c) { return n < c.first; });
    const auto index = static_cast<std::size_t>(after - chunks_.begin()) - 1;
    const Chunk& chunk = chunks_[index];
    if (unpacked_ != index) {
      unpacked_.reset();
      packed_.resize(static_cast<std::size_t>(chunk.bytes));
      Status read = file_.read(chunk.offset, packed_);
      if (read)
        if (const auto bytes = decode_laz_chunk(packed_, kind, chunk.points, unpacked_records_); !bytes)
          read = bytes.error();
      if (!read) {
        Error error = read.error();
        if (error.code != ErrorCode::Io)
          error.message = file_.path().string() + ": chunk " + std::to_string(index) + " at byte " +
                          std::to_string(chunk.offset) + ": " + error.message;
        return error;
      }
      unpacked_ = index;
    }
    const std::size_t skip = static_cast<std::size_t>(number - chunk.first) * kind.size;
    if (skip >= unpacked_records_.size())
      return Error{ErrorCode::Malformed, file_.path().string() + ": chunk " + std::to_string(index) +
                                             " has fewer points than the table of chunks counts"};
    const std::size_t bytes = std::min(unpacked_records_.size() - skip, (count - done) * kind.size);
    std::memcpy(buffer_.data() + done * kind.size, unpacked_records_.data() + skip, bytes);
    done += bytes / kind.size;
  }
  return {};
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
  if (Status done = fill(count); !done) return done;
  read_ += count;
  out.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    decode(ByteView(buffer_).subspan(i * header_.point_size, header_.point_size), out[i]);
  return {};
}

}  // namespace hueline::storage
