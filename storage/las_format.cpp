#include "storage/las_format.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hueline::storage {
namespace {

void append_text(Bytes& out, const std::string& text, std::size_t width) {
  const std::size_t at = out.size();
  append(out, as_bytes(std::string_view(text).substr(0, width)));
  out.resize(at + width);
}
std::string take_text(ByteReader& in, std::size_t width) {
  const ByteView bytes = in.take_bytes(width);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return std::string(text.substr(0, text.find('\0')));
}

}  // namespace

Bytes encode_las_header(const LasHeader& h) {
  Bytes out;
  append(out, as_bytes("LASF"));
  append(out, h.file_source_id);
  append(out, h.global_encoding);
  out.resize(out.size() + 16);  // GUID, not used
  append(out, std::uint8_t{1});
  append(out, static_cast<std::uint8_t>(h.version_minor));
  append_text(out, h.system_identifier, 32);
  append_text(out, h.generating_software, 32);
  append(out, static_cast<std::uint16_t>(h.creation_day));
  append(out, static_cast<std::uint16_t>(h.creation_year));
  append(out, static_cast<std::uint16_t>(kLasHeaderSize14));
  append(out, h.point_offset);
  append(out, h.vlr_count);
  append(out, h.point_format);
  append(out, h.point_size);
  // The point counts of older versions.
  const bool has_old_counts = (h.point_format & kLasFormatBits) < 6 && h.point_count <= 0xFFFFFFFF;
  append(out, static_cast<std::uint32_t>(has_old_counts ? h.point_count : 0));
  for (std::size_t k = 0; k < 5; ++k)
    append(out, static_cast<std::uint32_t>(has_old_counts ? h.points_by_return[k] : 0));
  for (const double s : h.scale) append(out, s);
  for (const double o : h.offset) append(out, o);
  for (std::size_t k = 0; k < 3; ++k) append(out, h.maximum[k]), append(out, h.minimum[k]);
  append(out, std::uint64_t{0});  // waveforms, not used
  append(out, h.evlr_offset);
  append(out, h.evlr_count);
  append(out, h.point_count);
  for (const std::uint64_t n : h.points_by_return) append(out, n);
  return out;
}

Result<LasHeader> decode_las_header(ByteView bytes) {
  ByteReader in(bytes);
  const ByteView signature = in.take_bytes(4);
  if (!in.ok() || !std::equal(signature.begin(), signature.end(), as_bytes("LASF").begin()))
    return Error{ErrorCode::Malformed, "not a LAS file (its first bytes are not LASF)"};
  LasHeader h;
  h.file_source_id = in.take<std::uint16_t>();
  h.global_encoding = in.take<std::uint16_t>();
  in.take_bytes(16);
  const int major = in.take<std::uint8_t>();
  h.version_minor = in.take<std::uint8_t>();
  if (!in.ok() || major != 1 || h.version_minor > 4)
    return Error{ErrorCode::Unsupported, "LAS version " + std::to_string(major) + "." +
                                             std::to_string(h.version_minor) + ": 1.0 to 1.4 are read"};
  h.system_identifier = take_text(in, 32);
  h.generating_software = take_text(in, 32);
  h.creation_day = in.take<std::uint16_t>();
  h.creation_year = in.take<std::uint16_t>();
  h.header_size = in.take<std::uint16_t>();
  h.point_offset = in.take<std::uint32_t>();
  h.vlr_count = in.take<std::uint32_t>();
  h.point_format = in.take<std::uint8_t>();
  h.point_size = in.take<std::uint16_t>();
  h.point_count = in.take<std::uint32_t>();
  for (std::size_t k = 0; k < 5; ++k) h.points_by_return[k] = in.take<std::uint32_t>();
  for (double& s : h.scale) s = in.take<double>();
  for (double& o : h.offset) o = in.take<double>();
  for (std::size_t k = 0; k < 3; ++k) h.maximum[k] = in.take<double>(), h.minimum[k] = in.take<double>();
  if (h.version_minor == 4) {
    in.take_bytes(8);
    h.evlr_offset = in.take<std::uint64_t>();
    h.evlr_count = in.take<std::uint32_t>();
    const auto count = in.take<std::uint64_t>();
    std::array<std::uint64_t, 15> by_return{};
    for (auto& n : by_return) n = in.take<std::uint64_t>();
    if (count != 0 || h.point_format >= 6) h.point_count = count, h.points_by_return = by_return;
  }
  if (!in.ok()) return Error{ErrorCode::Truncated, "the file ends inside its LAS header"};
  return h;
}

void append_vlr(Bytes& out, const LasVlr& vlr) {
  append(out, std::uint16_t{0});
  append_text(out, vlr.user_id, 16);
  append(out, vlr.record_id);
  append(out, static_cast<std::uint16_t>(vlr.data.size()));
  append_text(out, vlr.description, 32);
  append(out, as_bytes(vlr.data));
}

void append_evlr_head(Bytes& out, const std::string& user_id, std::uint16_t record_id, const std::string& description,
                      std::uint64_t size) {
  append(out, std::uint16_t{0});
  append_text(out, user_id, 16);
  append(out, record_id);
  append(out, size);
  append_text(out, description, 32);
}

std::size_t size_of(LasType type) {
  constexpr std::size_t kSizes[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::string encode_extra_fields(const std::vector<LasExtraField>& fields) {
  Bytes out;
  for (const LasExtraField& field : fields) {
    append(out, std::uint16_t{0});
    append(out, static_cast<std::uint8_t>(field.type));
    append(out, static_cast<std::uint8_t>(field.has_scale ? 0x18 : 0));  // bits of scale and offset
    append_text(out, field.name, 32);
    out.resize(out.size() + 4 + 3 * 24);  // unused, no_data, min, max
    append(out, field.has_scale ? field.scale : 0.0);
    out.resize(out.size() + 16);
    append(out, field.has_scale ? field.shift : 0.0);
    out.resize(out.size() + 16);
    append_text(out, field.description, 32);
  }
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}

std::vector<LasExtraField> decode_extra_fields(ByteView data, std::size_t first_offset) {
  std::vector<LasExtraField> fields;
  std::size_t offset = first_offset;
  for (; data.size() >= kLasExtraDescription; data = data.subspan(kLasExtraDescription)) {
    ByteReader in(data);
    in.take<std::uint16_t>();
    const auto type = in.take<std::uint8_t>();
    const auto options = in.take<std::uint8_t>();
    LasExtraField field;
    field.name = take_text(in, 32);
    in.take_bytes(4 + 3 * 24);
    std::array<double, 3> scales{}, shifts{};
    for (double& scale : scales) scale = in.take<double>();
    for (double& shift : shifts) shift = in.take<double>();
    field.description = take_text(in, 32);
    if (type == 0) {  // undocumented bytes; options is their number
      offset += options;
      continue;
    }
    if (type > 30) break;  // reserved; its size is unknown
    field.type = static_cast<LasType>((type - 1) % 10 + 1);
    field.has_scale = options & 0x18;
    const std::size_t values = (type - 1u) / 10 + 1;
    for (std::size_t i = 0; i < values; ++i) {
      LasExtraField& one = fields.emplace_back(field);
      if (values > 1) one.name += "[" + std::to_string(i) + "]";
      one.offset = offset;
      if (options & 0x08) one.scale = scales[i];
      if (options & 0x10) one.shift = shifts[i];
      offset += size_of(field.type);
    }
  }
  return fields;
}

std::size_t las_point_size(int format) {
  constexpr std::size_t kSizes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  return format >= 0 && format <= 10 ? kSizes[format] : 0;
}

double to_las_time(GpsTime time) {
  const std::int64_t ns = count_ns(time) - kAdjustedGpsSeconds * 1'000'000'000;
  return static_cast<double>(ns / 1'000'000'000) + static_cast<double>(ns % 1'000'000'000) * 1e-9;
}

GpsTime from_las_time(double adjusted_seconds) {
  constexpr double kFar = 8e9;  // s; the limit of int64 ns
  if (!(std::abs(adjusted_seconds) < kFar)) return {};
  const double whole = std::floor(adjusted_seconds);
  return GpsTime(std::chrono::seconds(static_cast<std::int64_t>(whole) + kAdjustedGpsSeconds) +
                 from_seconds(adjusted_seconds - whole));
}

}  // namespace hueline::storage
