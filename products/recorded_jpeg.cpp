#include "products/recorded_jpeg.hpp"

#include <array>
#include <optional>
#include <vector>

#include "storage/photo_file.hpp"

namespace hueline::products {
namespace {

using storage::Bytes;
using storage::ByteView;

constexpr std::size_t kMostBefore = 512;  // bytes of a packet's own head
constexpr std::uint8_t kHuffman = 0xC4, kScan = 0xDA;

std::uint8_t at(ByteView bytes, std::size_t i) { return std::to_integer<std::uint8_t>(bytes[i]); }
std::uint32_t two(ByteView bytes, std::size_t i) { return std::uint32_t{at(bytes, i)} << 8 | at(bytes, i + 1); }

/// A marker segment, with its marker.
struct Segment {
  std::uint8_t marker = 0;
  ByteView bytes;
};

/// Returns the segments up to the first scan, that of its head included; nothing if they are broken.
std::optional<std::vector<Segment>> segments_of(ByteView jpeg) {
  std::vector<Segment> out;
  for (std::size_t i = 2; i + 4 <= jpeg.size();) {
    if (at(jpeg, i) != 0xFF) return {};
    const std::uint8_t marker = at(jpeg, i + 1);
    if (marker == 0xFF) {  // a fill byte
      ++i;
      continue;
    }
    const std::size_t size = 2 + two(jpeg, i + 2);
    if (marker < 0xC0 || (marker >= 0xD0 && marker <= 0xD9) || size < 4 || size > jpeg.size() - i) return {};
    out.push_back({marker, jpeg.subspan(i, size)});
    if (marker == kScan) return out;
    i += size;
  }
  return {};
}

std::optional<std::size_t> begin_of(ByteView packet) {
  for (std::size_t i = 0; i + 3 <= packet.size() && i < kMostBefore; ++i)
    if (at(packet, i) == 0xFF && at(packet, i + 1) == 0xD8 && at(packet, i + 2) == 0xFF) return i;
  return {};
}

/// The tables of annex K.3: those that an encoder writes which does not make its own.
Bytes usual_tables() {
  constexpr std::array<std::uint8_t, 3> kPixel{};
  Bytes out;
  const auto some = storage::encode_jpeg({kPixel.data(), 1, 1}, 90, {});
  if (!some) return out;
  const auto segments = segments_of(*some);
  if (segments)
    for (const Segment& one : *segments)
      if (one.marker == kHuffman) storage::append(out, one.bytes);
  return out;
}

}  // namespace

bool may_hold_jpeg(ByteView packet) { return begin_of(packet).has_value(); }

Bytes recorded_jpeg(ByteView packet, std::uint32_t width, std::uint32_t height) {
  const auto begin = begin_of(packet);
  if (!begin) return {};
  ByteView jpeg = packet.subspan(*begin);
  std::size_t end = jpeg.size();
  while (end >= 2 && !(at(jpeg, end - 2) == 0xFF && at(jpeg, end - 1) == 0xD9)) --end;
  if (end < 2) return {};
  jpeg = jpeg.first(end);
  const auto segments = segments_of(jpeg);
  if (!segments) return {};
  bool is_image = false, has_tables = false;
  for (const Segment& one : *segments) {
    has_tables = has_tables || one.marker == kHuffman;
    if (one.marker != 0xC0 && one.marker != 0xC1) continue;
    if (one.bytes.size() < 10) return {};
    const std::uint8_t components = at(one.bytes, 9);
    is_image = at(one.bytes, 4) == 8 && two(one.bytes, 5) == height && two(one.bytes, 7) == width &&
               (components == 1 || components == 3);
  }
  if (!is_image) return {};
  if (has_tables) return {jpeg.begin(), jpeg.end()};
  const auto scan = static_cast<std::size_t>(segments->back().bytes.data() - jpeg.data());
  Bytes out(jpeg.begin(), jpeg.begin() + static_cast<std::ptrdiff_t>(scan));
  storage::append(out, usual_tables());
  storage::append(out, jpeg.subspan(scan));
  return out;
}

}  // namespace hueline::products
