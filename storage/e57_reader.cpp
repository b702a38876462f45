#include "storage/e57_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "core/portable_math.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint64_t kMostDescription = 64u << 20;  // thousands of scans; as a tree it takes up to 20 times as much
constexpr std::size_t kMostWaiting = 16u << 20;        // bytes of a field whose points lack those of another one

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
  if (length > kMostDescription)
    return wrong(ErrorCode::Unsupported, fmt::format("has a description of more than {} MB", kMostDescription >> 20));

  E57Reader out(E57Pages(std::move(*file)));
  const std::uint64_t begin = e57_place_in_content(place);
  if (begin > out.pages_.size() || length > out.pages_.size() - begin)
    return wrong(ErrorCode::Malformed, "has its description behind its end");
  std::string text(static_cast<std::size_t>(length), '\0');
  if (Status read = out.pages_.read(begin, std::as_writable_bytes(std::span(text))); !read.ok()) return read.error();
  auto description = decode_e57_description(text, path.string());
  if (!description.ok()) return description.error();
  out.description_ = std::move(*description);
  return out;
}

Status E57Reader::begin(std::size_t scan) {
  const E57Scan& wanted = scans()[scan];
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
  const E57Scan& scan = scans()[scan_];
  std::size_t out = std::numeric_limits<std::size_t>::max();
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (const unsigned bits = scan.columns[i].bits; bits > 0)
      out = std::min(out, (8 * streams_[i].bytes.size() - streams_[i].at_bit) / bits);
  return out;
}

Status E57Reader::read_packet() {
  const auto wrong = [&](ErrorCode code, const std::string& what) {
    return Error{code, fmt::format("{}: scan {}: {}; {} of its {} points were read", name(), scan_, what,
                                   scans()[scan_].points - left_, scans()[scan_].points)};
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
      return wrong(
          ErrorCode::Malformed,
          fmt::format("a packet of {} bytes at byte {}, and {}", size, e57_place_in_file(at_),
                      at_ + size > end_ ? "its section ends before it" : "lengths of packets are multiples of 4"));
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
      const ByteView more = in.take_bytes(lengths[i]);
      if (scans()[scan_].columns[i].bits == 0) continue;
      // Bytes are moved only if fewer stay than go, so that a slow stream does not cost its length with each packet.
      if (const std::size_t used = stream.at_bit / 8; 2 * used >= stream.bytes.size()) {
        stream.bytes.erase(stream.bytes.begin(), stream.bytes.begin() + static_cast<std::ptrdiff_t>(used));
        stream.at_bit -= 8 * used;
      }
      append(stream.bytes, more);
      if (stream.bytes.size() > kMostWaiting)
        return wrong(ErrorCode::Unsupported, fmt::format("its field {} is more than {} MB ahead of another one",
                                                         scans()[scan_].columns[i].name, kMostWaiting >> 20));
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
    const E57Column& column = scans()[scan_].columns[i];
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
