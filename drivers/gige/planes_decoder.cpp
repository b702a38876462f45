#include "drivers/gige/planes_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace hueline::drivers {
namespace {

Fault malformed(const Packet& packet, std::uint64_t count, std::string detail) {
  return {packet.sensor, FaultKind::Malformed, packet.received, count, std::move(detail)};
}

}  // namespace

void PlanesDecoder::decode(std::span<const std::byte> bytes, const Packet& packet, Image image, DecodeCounts& counts,
                           std::vector<Measurement>& out) {
  const std::size_t size = packet.bytes.size();
  image.width = image.stride = width_;
  image.height = height_;
  const auto planes = read_jpeg_planes(bytes);
  MutableBuffer mosaic = planes ? mosaics_.acquire(std::size_t{width_} * height_) : MutableBuffer();
  if (!mosaic) {
    counts.malformed_bytes += size;
    ++counts.malformed_messages;
    out.push_back(malformed(
        packet, 1,
        fmt::format("image {}: {}", image.frame_id, planes ? "no memory for its pixels" : planes.error().message)));
    return;
  }
  image.reported = layout_.reported(*planes, width_, height_);
  auto* pixels = reinterpret_cast<std::uint8_t*>(mosaic.data());
  std::size_t wanted = 0, lost_bytes = 0;
  std::string first;
  for (std::size_t lens = 0; lens < kHeadLenses; ++lens) {
    const PixelRegion at = layout_.region_of(lens, width_, height_);
    std::string why = layout_.is_used[lens] ? decode_lens(lens, *planes, pixels) : std::string();
    if (layout_.is_used[lens]) ++wanted;
    if (layout_.is_used[lens] && why.empty()) continue;
    for (std::uint32_t row = 0; row < at.height; ++row)
      std::memset(pixels + std::size_t{at.y + row} * width_ + at.x, 0, at.width);
    if (why.empty()) continue;
    if (image.lost.empty()) first = fmt::format("lens {}: {}", lens, why);
    image.lost.push_back(at);
    for (const auto& plane : planes->planes[lens]) lost_bytes += plane.size();
  }
  // In a broken table planes may overlap, but each byte may be counted only once.
  // A camera of which the rig uses no lens loses none: its images have times, and no pixels.
  const bool is_all_lost = wanted > 0 && image.lost.size() == wanted;
  lost_bytes = is_all_lost ? size : std::min(lost_bytes, size);
  counts.malformed_bytes += lost_bytes;
  counts.decoded_bytes += size - lost_bytes;
  if (!image.lost.empty()) {
    counts.malformed_messages += image.lost.size();
    counts.messages["LensLost"] += image.lost.size();
    out.push_back(
        malformed(packet, image.lost.size(),
                  fmt::format("image {}: {} of {} lenses lost; {}", image.frame_id, image.lost.size(), wanted, first)));
  }
  if (is_all_lost) return;
  image.buffer = std::move(mosaic).share();
  out.push_back(std::move(image));
}

std::string PlanesDecoder::decode_lens(std::size_t lens, const JpegPlanes& planes, std::uint8_t* mosaic) {
  BayerJpegDecoder::Planes by_place;
  std::array<std::size_t, kCellPlaces> slot_of{};
  for (std::size_t slot = 0; slot < kCellPlaces; ++slot) {
    if (!planes.why_empty[lens][slot].empty()) return fmt::format("plane {} {}", slot, planes.why_empty[lens][slot]);
    by_place[layout_.plane_places[slot]] = planes.planes[lens][slot];
    slot_of[layout_.plane_places[slot]] = slot;
  }
  const PixelRegion at = layout_.region_of(lens, width_, height_);
  const auto problem =
      jpeg_.decode(by_place, {mosaic + std::size_t{at.y} * width_ + at.x, width_, at.width, at.height});
  return problem.why.empty() ? std::string() : fmt::format("plane {}: {}", slot_of[problem.place], problem.why);
}

}  // namespace hueline::drivers
