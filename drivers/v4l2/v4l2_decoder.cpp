#include "drivers/v4l2/v4l2_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hueline::drivers {
namespace {

Fault fault(const Packet& packet, FaultKind kind, std::uint64_t count, std::string detail) {
  return {packet.sensor, kind, packet.received, count, std::move(detail)};
}

}  // namespace

void V4l2Decoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  const std::size_t size = packet.bytes.size();
  const auto header = decode_v4l2_header(packet.bytes.bytes());
  if (!header) {
    counts_.malformed_bytes += size;
    ++counts_.malformed_messages;
    out.push_back(fault(packet, FaultKind::Malformed, 1, header.error().message));
    return;
  }
  const auto refuse = [&](FaultKind kind, std::string why) {
    counts_.ignored_bytes += size;
    out.push_back(fault(packet, kind, 1, std::move(why)));
  };
  ++counts_.of(fourcc_text(header->fourcc));
  const auto frame_id = follow(*header, packet, out);
  if (!frame_id) {
    counts_.ignored_bytes += size;
    return;
  }
  const V4l2Format* format = find_v4l2_format(header->fourcc);
  if (!format || header->fourcc != config_.fourcc)
    return refuse(FaultKind::WrongDevice,
                  fmt::format("image {} has pixel format {}; the rig names {}", header->sequence,
                              fourcc_text(header->fourcc), fourcc_text(config_.fourcc)));
  if (header->width != config_.width || header->height != config_.height)
    return refuse(FaultKind::WrongSize, fmt::format("image {} is {} x {}; the rig says {} x {}", header->sequence,
                                                    header->width, header->height, config_.width, config_.height));
  if (format->row_bytes(header->width) > header->stride)
    return refuse(FaultKind::WrongSize, fmt::format("image {} has {} bytes from row to row; {} pixels of {} need {}",
                                                    header->sequence, header->stride, header->width,
                                                    fourcc_text(header->fourcc), format->row_bytes(header->width)));

  Image image;
  image.sensor = packet.sensor;
  image.received = packet.received;
  image.packet_sequence = packet.sequence;
  image.frame_id = *frame_id;
  if (header->is_monotonic()) image.time = DeviceTime<CameraCounter>(header->stamp);
  image.width = header->width;
  image.height = header->height;
  image.format = format->image;
  image.stride = header->width * converted_pixel_bytes(format->image);
  const std::uint64_t needed = format->image_bytes(header->width, header->height, header->stride);
  if (header->is_damaged() || header->used_bytes < needed) {
    counts_.ignored_bytes += size;
    out.push_back(fault(packet, FaultKind::Lost, 1,
                        header->is_damaged() ? fmt::format("image {} is damaged, as its driver says", header->sequence)
                                             : fmt::format("image {} has {} bytes of {}", header->sequence,
                                                           header->used_bytes, needed)));
    out.push_back(std::move(image));
    return;
  }
  if (std::string why = take_pixels(*format, *header, packet, image); !why.empty()) {
    counts_.malformed_bytes += size;
    ++counts_.malformed_messages;
    out.push_back(fault(packet, FaultKind::Malformed, 1, fmt::format("image {}: {}", header->sequence, why)));
    image.buffer = {};
  } else {
    counts_.decoded_bytes += size;
    image.is_complete = true;
  }
  out.push_back(std::move(image));
}

std::string V4l2Decoder::take_pixels(const V4l2Format& format, const V4l2Header& header, const Packet& packet,
                                     Image& image) {
  if (format.packing == V4l2Packing::Bytes) {
    image.stride = header.stride;
    image.buffer = packet.bytes;
    image.pixel_offset = kV4l2HeaderSize;
    return {};
  }
  if (format.packing == V4l2Packing::Jpeg) return take_jpeg(packet, image);
  MutableBuffer pixels = converted_.acquire(std::size_t{image.stride} * image.height);
  if (!pixels) return "no memory for its pixels";
  convert_v4l2_pixels(format, ycbcr_coding(header.colour_space, header.ycbcr_encoding, header.quantisation),
                      header.width, header.height, header.stride, packet.bytes.bytes().subspan(kV4l2HeaderSize),
                      pixels.data());
  image.buffer = std::move(pixels).share();
  return {};
}

std::string V4l2Decoder::take_jpeg(const Packet& packet, Image& image) {
  const auto bytes = packet.bytes.bytes().subspan(kV4l2HeaderSize);
  const MotionJpegDecoder::Head head = jpeg_.read_head(bytes);
  if (!head.why.empty()) return head.why;
  if (head.width != image.width || head.height != image.height)
    return fmt::format("its JPEG is {} x {}, not {} x {}", head.width, head.height, image.width, image.height);
  image.format = head.format;
  image.stride = image.width * converted_pixel_bytes(head.format);
  MutableBuffer pixels = converted_.acquire(std::size_t{image.stride} * image.height);
  if (!pixels) return "no memory for its pixels";
  if (std::string why = jpeg_.decode(bytes, pixels.data()); !why.empty()) return why;
  image.buffer = std::move(pixels).share();
  return {};
}

std::optional<std::uint64_t> V4l2Decoder::follow(const V4l2Header& header, const Packet& packet,
                                                 std::vector<Measurement>& out) {
  const auto last = last_;
  last_ = Last{header.sequence, header.stamp, header.sequence};
  if (!last) return last_->frame_id;
  const auto spurious = [&](std::string why) { out.push_back(fault(packet, FaultKind::Spurious, 1, std::move(why))); };
  const std::uint32_t step = header.sequence - last->sequence;  // correct when the 32-bit count wraps
  if (step > UINT32_MAX / 2) {
    spurious(fmt::format("the sequence fell from {} to {}: the driver restarted", last->sequence, header.sequence));
    return last_->frame_id;
  }
  if (step == 0 && header.is_monotonic() && header.stamp == last->stamp) {
    spurious(fmt::format("image {} came twice", header.sequence));
    last_ = last;
    return std::nullopt;
  }
  last_->frame_id = last->frame_id + std::max(step, 1u);
  if (step == 0) spurious(fmt::format("the driver gave two images the number {}", header.sequence));
  if (step > 1)
    out.push_back(fault(packet, FaultKind::Lost, step - 1,
                        fmt::format("images lost between {} and {}", last->sequence, header.sequence)));
  return last_->frame_id;
}

}  // namespace hueline::drivers
