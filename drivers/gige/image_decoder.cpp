#include "drivers/gige/image_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

namespace hueline::drivers {

namespace {

constexpr std::uint64_t kLargestShortId = 0xFFFF;

Fault fault(const Packet& packet, FaultKind kind, std::uint64_t count, std::string detail) {
  return {packet.sensor, kind, packet.received, count, std::move(detail)};
}

/// Makes an Image with the members that do not depend on the payload.
Image image_of(const ImageHeader& header, const Packet& packet) {
  Image image;
  image.sensor = packet.sensor;
  image.received = packet.received;
  image.packet_sequence = packet.sequence;
  image.frame_id = header.frame_id;
  image.time = header.time;
  image.is_complete = header.status == ImageStatus::Complete;
  image.missing_packets = header.missing_packets;
  return image;
}

}  // namespace

KeyError ImageDecoder::Config::validate() const {
  constexpr std::uint32_t kLargest = 65536;
  if (width > kLargest) return not_allowed("width", std::to_string(width), "0 to 65536 px");
  if (height > kLargest) return not_allowed("height", std::to_string(height), "0 to 65536 px");
  if (payload == ImagePayload::Rows) return {};
  if (!pixel_format || *pixel_format == PixelFormat::Mono8 || *pixel_format == PixelFormat::Rgb8)
    return not_allowed("pixel_format", pixel_format ? name(*pixel_format) : "any",
                       "a Bayer mosaic's, for JPEG planes: BayerRG8, BayerBG8, BayerGR8 or BayerGB8");
  return planes.validate(width, height);
}

ImageDecoder::ImageDecoder(Config config) : config_(config), mosaics_(std::numeric_limits<std::size_t>::max()) {}

void ImageDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  const auto bytes = packet.bytes.bytes();
  const auto malformed = [&](std::string why) {
    counts_.malformed_bytes += bytes.size();
    ++counts_.malformed_messages;
    out.push_back(fault(packet, FaultKind::Malformed, 1, std::move(why)));
  };
  const auto header = decode_image_header(bytes);
  if (!header) return malformed(header.error().message);
  if (header->status == ImageStatus::NoLeader) {
    ++counts_.messages[name(header->status)];
    counts_.ignored_bytes += bytes.size();
    return;
  }
  if (bytes.size() - kImageHeaderSize < header->pixel_bytes())
    return malformed(fmt::format("image {}: {} bytes of pixels; {} rows of {} bytes are {}", header->frame_id,
                                 bytes.size() - kImageHeaderSize, header->height, header->stride,
                                 header->pixel_bytes()));
  ++counts_.messages[name(header->status)];
  if (!follow(header->frame_id, packet, out)) {
    counts_.ignored_bytes += bytes.size();
    return;
  }
  if (config_.payload == ImagePayload::Rows)
    take_rows(*header, packet, out);
  else
    take_planes(*header, packet, out);
}

void ImageDecoder::take_rows(const ImageHeader& header, const Packet& packet, std::vector<Measurement>& out) {
  const auto refuse = [&](FaultKind kind, std::string why) {
    counts_.ignored_bytes += packet.bytes.size();
    out.push_back(fault(packet, kind, 1, std::move(why)));
  };
  const auto format = pixel_format_of(header.pfnc);
  if (!format || (config_.pixel_format && *format != *config_.pixel_format))
    return refuse(FaultKind::WrongDevice,
                  fmt::format("image {} has pixel format {} (PFNC 0x{:08x}); the rig names {}", header.frame_id,
                              format ? name(*format) : "unknown", header.pfnc,
                              config_.pixel_format ? name(*config_.pixel_format) : "an 8-bit one"));
  if ((config_.width && header.width != config_.width) || (config_.height && header.height != config_.height))
    return refuse(FaultKind::WrongSize, fmt::format("image {} is {} x {}; the rig says {} x {}", header.frame_id,
                                                    header.width, header.height, config_.width, config_.height));
  counts_.decoded_bytes += packet.bytes.size();
  Image image = image_of(header, packet);
  image.width = header.width;
  image.height = header.height;
  image.stride = header.stride;
  image.format = *format;
  image.buffer = packet.bytes;
  image.pixel_offset = kImageHeaderSize;
  out.push_back(std::move(image));
}

void ImageDecoder::take_planes(const ImageHeader& header, const Packet& packet, std::vector<Measurement>& out) {
  const std::size_t size = packet.bytes.size();
  Image image = image_of(header, packet);
  image.width = image.stride = config_.width;
  image.height = config_.height;
  image.format = *config_.pixel_format;
  if (!image.is_complete) {
    counts_.ignored_bytes += size;
    out.push_back(std::move(image));
    return;
  }
  const auto planes = read_jpeg_planes(packet.bytes.bytes().subspan(kImageHeaderSize, header.pixel_bytes()));
  MutableBuffer mosaic = planes ? mosaics_.acquire(std::size_t{config_.width} * config_.height) : MutableBuffer();
  if (!mosaic) {
    counts_.malformed_bytes += size;
    ++counts_.malformed_messages;
    out.push_back(fault(
        packet, FaultKind::Malformed, 1,
        fmt::format("image {}: {}", header.frame_id, planes ? "no memory for its pixels" : planes.error().message)));
    return;
  }
  auto* pixels = reinterpret_cast<std::uint8_t*>(mosaic.data());
  std::size_t wanted = 0, lost_bytes = 0;
  std::string first;
  for (std::size_t lens = 0; lens < kHeadLenses; ++lens) {
    const PixelRegion at = region_of(lens);
    std::string why = config_.planes.is_used[lens] ? decode_lens(lens, *planes, pixels) : std::string();
    if (config_.planes.is_used[lens]) ++wanted;
    if (config_.planes.is_used[lens] && why.empty()) continue;
    for (std::uint32_t row = 0; row < at.height; ++row)
      std::memset(pixels + std::size_t{at.y + row} * config_.width + at.x, 0, at.width);
    if (why.empty()) continue;
    if (image.lost.empty()) first = fmt::format("lens {}: {}", lens, why);
    image.lost.push_back(at);
    for (const auto& plane : planes->planes[lens]) lost_bytes += plane.size();
  }
  // In a broken table planes may overlap, but each byte may be counted only once.
  const bool is_all_lost = image.lost.size() == wanted;
  lost_bytes = is_all_lost ? size : std::min(lost_bytes, size);
  counts_.malformed_bytes += lost_bytes;
  counts_.decoded_bytes += size - lost_bytes;
  if (!image.lost.empty()) {
    counts_.malformed_messages += image.lost.size();
    counts_.messages["LensLost"] += image.lost.size();
    out.push_back(
        fault(packet, FaultKind::Malformed, image.lost.size(),
              fmt::format("image {}: {} of {} lenses lost; {}", header.frame_id, image.lost.size(), wanted, first)));
  }
  if (is_all_lost) return;
  image.buffer = std::move(mosaic).share();
  out.push_back(std::move(image));
}

PixelRegion ImageDecoder::region_of(std::size_t lens) const {
  const std::uint32_t columns = config_.planes.lens_columns, index = static_cast<std::uint32_t>(lens);
  const std::uint32_t width = config_.width / columns, height = config_.height / config_.planes.lens_rows();
  return {index % columns * width, index / columns * height, width, height};
}

std::string ImageDecoder::decode_lens(std::size_t lens, const JpegPlanes& planes, std::uint8_t* mosaic) {
  BayerJpegDecoder::Planes by_place;
  std::array<std::size_t, kCellPlaces> slot_of{};
  for (std::size_t slot = 0; slot < kCellPlaces; ++slot) {
    if (!planes.why_empty[lens][slot].empty()) return fmt::format("plane {} {}", slot, planes.why_empty[lens][slot]);
    by_place[config_.planes.plane_places[slot]] = planes.planes[lens][slot];
    slot_of[config_.planes.plane_places[slot]] = slot;
  }
  const PixelRegion at = region_of(lens);
  const auto problem =
      jpeg_.decode(by_place, {mosaic + std::size_t{at.y} * config_.width + at.x, config_.width, at.width, at.height});
  return problem.why.empty() ? std::string() : fmt::format("plane {}: {}", slot_of[problem.place], problem.why);
}

bool ImageDecoder::follow(std::uint64_t frame_id, const Packet& packet, std::vector<Measurement>& out) {
  const auto last = std::exchange(last_frame_id_, frame_id);
  if (!last || frame_id == *last + 1) return true;
  if (frame_id == *last) {
    out.push_back(fault(packet, FaultKind::Spurious, 1, fmt::format("image {} came twice", frame_id)));
    return false;
  }
  std::uint64_t lost = 0;
  if (frame_id > *last) {
    lost = frame_id - *last - 1;
  } else if (*last <= kLargestShortId && *last - frame_id > kLargestShortId / 2) {
    // GigE Vision 1.x: 65535 is followed by 1. A device that does use 0 is accepted as well.
    lost = kLargestShortId - *last + (frame_id ? frame_id - 1 : 0);
  } else {
    out.push_back(fault(packet, FaultKind::Spurious, 1,
                        fmt::format("frame id fell from {} to {}: the camera restarted", *last, frame_id)));
  }
  if (lost)
    out.push_back(fault(packet, FaultKind::Lost, lost, fmt::format("images lost between {} and {}", *last, frame_id)));
  return true;
}

}  // namespace hueline::drivers
