#include "storage/scan_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

#include "storage/e57_cloud.hpp"
#include "storage/pcd_reader.hpp"

namespace hueline::storage {
namespace {

// A block is small enough to stay in a core's cache between reading and filtering.
constexpr std::uint64_t kBlockBytes = 1 << 20;
constexpr std::uint64_t kMostCompressed = 512u << 20;
constexpr std::size_t kMostLine = 4096;

template <class T>
T value_at(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

template <class Bits>
Bits bits_at(const std::byte* at, bool is_big_endian) {
  const Bits bits = value_at<Bits>(at);
  if (!is_big_endian) return bits;
  if constexpr (sizeof(Bits) == 4)
    return __builtin_bswap32(bits);
  else
    return __builtin_bswap64(bits);
}

bool is_separator(char c) { return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r'; }

/// Reads the wanted columns of a line of numbers. Returns false if one is missing or is no number.
bool parse_line(std::string_view line, const std::array<std::size_t, 3>& columns, std::array<double, 3>& out) {
  const std::size_t last = std::max({columns[0], columns[1], columns[2]});
  std::size_t i = 0, column = 0, found = 0;
  while (i < line.size() && column <= last) {
    while (i < line.size() && is_separator(line[i])) ++i;
    const std::size_t begin = i;
    while (i < line.size() && !is_separator(line[i])) ++i;
    if (i == begin) break;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (columns[axis] != column) continue;
      double value = 0;
      const auto [end, error] = std::from_chars(line.data() + begin, line.data() + i, value);
      if (error != std::errc() || end != line.data() + i) return false;
      out[axis] = value;
      ++found;
    }
    ++column;
  }
  return found == 3;
}

bool is_comment(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  return begin == std::string_view::npos || line[begin] == '#' || line.substr(begin).starts_with("//");
}

}  // namespace

/// Writes a place as block() gives it.
void ScanFile::put_place(const std::array<double, 3>& xyz, float* out) const {
  constexpr std::array<double, 3> kZero{};
  const bool is_none = xyz == kZero && origin_ != kZero;
  for (std::size_t axis = 0; axis < 3; ++axis)
    out[axis] = is_none ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(xyz[axis] - origin_[axis]);
}

Result<ScanFile> ScanFile::open(const std::filesystem::path& path, std::optional<ScanFormat> format,
                                const std::array<double, 3>& origin) {
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  auto layout = read_scan_layout(*file, format);
  if (!layout.ok()) return layout.error();
  ScanFile scan(std::move(file).value(), std::move(layout).value(), origin);
  const ScanLayout& known = scan.layout_;
  if (known.is_text) {
    scan.block_size_ = kBlockBytes;
    scan.block_count_ = static_cast<std::size_t>(
        (scan.file_.size() - std::min(known.begin, scan.file_.size()) + kBlockBytes - 1) / kBlockBytes);
    return scan;
  }
  if (known.format == ScanFormat::E57) {
    const Status read = read_e57_places(path, [&](const Point<Scanner>& place) {
      scan.whole_.resize(scan.whole_.size() + 3);
      scan.put_place({place.xyz.x(), place.xyz.y(), place.xyz.z()}, &scan.whole_[scan.whole_.size() - 3]);
    });
    if (!read.ok()) return read.error();
    scan.layout_.points = scan.whole_.size() / 3;
    scan.block_size_ = kBlockBytes / 12;
  } else if (known.record_size == 0) {
    if (scan.file_.size() > kMostCompressed)
      return Error{ErrorCode::Unsupported,
                   fmt::format("{}: binary_compressed PCD is unpacked in memory, up to {} MB: write it as binary",
                               path.string(), kMostCompressed >> 20)};
    const auto cloud = read_pcd(path.string());
    if (!cloud.ok()) return cloud.error();
    const std::span<const double> axes[] = {cloud->column("x"), cloud->column("y"), cloud->column("z")};
    scan.whole_.resize(3 * cloud->points());
    for (std::size_t i = 0; i < cloud->points(); ++i)
      scan.put_place({axes[0][i], axes[1][i], axes[2][i]}, &scan.whole_[3 * i]);
    scan.block_size_ = kBlockBytes / 12;
  } else {
    scan.block_size_ = std::max<std::uint64_t>(1, kBlockBytes / known.record_size);
    const std::uint64_t held =
        known.begin <= scan.file_.size() ? (scan.file_.size() - known.begin) / known.record_size : 0;
    if (held < *known.points)
      return Error{ErrorCode::Truncated, fmt::format("{}: holds {} of the {} points that its header counts",
                                                     path.string(), held, *known.points)};
  }
  scan.block_count_ = static_cast<std::size_t>((*known.points + scan.block_size_ - 1) / scan.block_size_);
  return scan;
}

Result<std::span<const float>> ScanFile::block(std::size_t index, std::vector<std::byte>& scratch) const {
  if (!whole_.empty()) {
    const std::size_t begin = 3 * index * block_size_;
    return std::span<const float>(whole_).subspan(begin, std::min<std::size_t>(3 * block_size_, whole_.size() - begin));
  }
  return layout_.is_text ? lines(index, scratch) : records(index, scratch);
}

Result<std::span<const float>> ScanFile::records(std::size_t index, std::vector<std::byte>& scratch) const {
  const std::uint64_t first = index * block_size_;
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block_size_, *layout_.points - first));
  const std::size_t raw = count * layout_.record_size;
  const bool as_is = layout_.number == ScanLayout::Number::Float32 && !layout_.is_big_endian &&
                     layout_.record_size == 12 && layout_.place == std::array<std::size_t, 3>{0, 4, 8} &&
                     origin_ == std::array<double, 3>{};
  // The decoded coordinates are stored behind the records, aligned.
  const std::size_t behind = (raw + 63) / 64 * 64, wanted = as_is ? raw : behind + count * 12;
  if (scratch.size() < wanted) scratch.resize(wanted);
  if (Status done = file_.read(layout_.begin + first * layout_.record_size, std::span(scratch).first(raw)); !done.ok())
    return done.error();
  if (as_is) return std::span<const float>(reinterpret_cast<const float*>(scratch.data()), 3 * count);
  auto* out = reinterpret_cast<float*>(scratch.data() + behind);
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* record = scratch.data() + i * layout_.record_size;
    std::array<double, 3> xyz;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::byte* at = record + layout_.place[axis];
      double& value = xyz[axis];
      switch (layout_.number) {
        case ScanLayout::Number::Float32:
          value = std::bit_cast<float>(bits_at<std::uint32_t>(at, layout_.is_big_endian));
          break;
        case ScanLayout::Number::Float64:
          value = std::bit_cast<double>(bits_at<std::uint64_t>(at, layout_.is_big_endian));
          break;
        case ScanLayout::Number::ScaledInt32:
          value = value_at<std::int32_t>(at) * layout_.scale[axis] + layout_.offset[axis];
          break;
      }
    }
    put_place(xyz, out + 3 * i);
  }
  return std::span<const float>(out, 3 * count);
}

/// A block of text holds the lines that begin in it.
Result<std::span<const float>> ScanFile::lines(std::size_t index, std::vector<std::byte>& scratch) const {
  const std::uint64_t begin = layout_.begin + index * block_size_, end = std::min(begin + block_size_, file_.size());
  // The block is read with one byte before it, to see whether a line begins at its start, and with a line's length
  // behind it, to finish its last line.
  const std::uint64_t from = index == 0 ? begin : begin - 1,
                      to = std::min<std::uint64_t>(end + kMostLine, file_.size());
  const auto size = static_cast<std::size_t>(to - from);
  const std::size_t behind = (size + 63) / 64 * 64;
  // The shortest line with a point has six bytes: "0 0 0" and the line end.
  const std::size_t most = static_cast<std::size_t>(end - begin) / 6 + 2;
  if (scratch.size() < behind + 12 * most) scratch.resize(behind + 12 * most);
  if (Status done = file_.read(from, std::span(scratch).first(size)); !done.ok()) return done.error();
  const std::string_view text(reinterpret_cast<const char*>(scratch.data()), size);
  auto* out = reinterpret_cast<float*>(scratch.data() + behind);
  std::size_t count = 0, at = 0;
  if (index > 0) {
    at = text.find('\n');
    if (at == std::string_view::npos)
      return Error{ErrorCode::Malformed,
                   fmt::format("{}: a line of more than {} bytes at byte {}", file_.path().string(), kMostLine, from)};
    ++at;
  }
  while (from + at < end) {
    const std::size_t stop = text.find('\n', at);
    if (stop == std::string_view::npos && to != file_.size())
      return Error{ErrorCode::Malformed, fmt::format("{}: a line of more than {} bytes at byte {}",
                                                     file_.path().string(), kMostLine, from + at)};
    const std::string_view line = text.substr(at, stop == std::string_view::npos ? std::string_view::npos : stop - at);
    const std::uint64_t place = from + at;
    at = stop == std::string_view::npos ? text.size() : stop + 1;
    if (is_comment(line)) continue;
    if (std::array<double, 3> xyz; parse_line(line, layout_.place, xyz)) {
      put_place(xyz, out + 3 * count++);
      continue;
    }
    if (layout_.may_have_title && place == layout_.begin) continue;
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: at byte {}: '{}' has no x y z", file_.path().string(), place, line.substr(0, 60))};
  }
  return std::span<const float>(out, 3 * count);
}

}  // namespace hueline::storage
