#include "drivers/gige/image_decoder.hpp"

#include <fmt/format.h>

#include <string>
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
  if (header.exposure > nanoseconds(0) || header.gain > 0)
    image.reported.push_back({.duration = header.exposure, .gain = header.gain});
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

ImageDecoder::ImageDecoder(Config config) : config_(config), planes_(config.width, config.height, config.planes) {}

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
  Image image = image_of(header, packet);
  image.format = *config_.pixel_format;
  if (!image.is_complete) {
    image.width = image.stride = config_.width;
    image.height = config_.height;
    counts_.ignored_bytes += packet.bytes.size();
    out.push_back(std::move(image));
    return;
  }
  planes_.decode(packet.bytes.bytes().subspan(kImageHeaderSize, header.pixel_bytes()), packet, std::move(image),
                 counts_, out);
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
