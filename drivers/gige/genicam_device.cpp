#include "drivers/gige/genicam_device.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "drivers/guest/guest_source.hpp"

namespace hueline::drivers {

void GenicamDevice::visit(Keys& keys) {
  keys.whole(required("width", "px", "The width of the delivered image. An image of another size is fault WrongSize."),
             width_, {1, 65535});
  keys.whole(required("height", "px", "The height of the delivered image."), height_, {1, 65535});
  visit_pixel_format(keys, required("pixel_format", "", "The pixel format of the delivered image."), pixel_format_);
  keys.kinds({"payload", "",
              "What the camera sends. `jpeg_planes`: six lenses as 24 grey JPEGs, one a place of the Bayer cell "
              "([formats](formats.md#jpeg-planes)). The camera then keeps "
              "its own region and sends bytes as Mono8; `width`, `height` and `pixel_format` are those of the mosaic "
              "that the planes make."},
             {.words = {"rows", "jpeg_planes"},
              .chosen = static_cast<std::size_t>(payload_),
              .make = [this](std::size_t word) {
                payload_ = static_cast<ImagePayload>(word);
                return KeyGroup{[this](Keys& inside) {
                                  if (payload_ == ImagePayload::JpegPlanes) planes_.visit(inside);
                                },
                                [] { return KeyError(); }};
              }});
  camera_.visit(keys);
}

KeyError GenicamDevice::validate() const {
  if (KeyError wrong = source().validate(); !wrong.empty()) return wrong;
  return decoder().validate();
}

// Aravis runs in a process of its own (hueline-guest), because it may crash.
std::unique_ptr<PacketSource> GenicamDevice::make_source(const BufferPool&) const {
  GuestSource::Config guest;
  guest.driver = kGenicam.word;
  guest.text = source().to_text();
  guest.slots = camera_.stream_buffers + camera_.images_in_flight;
  return std::make_unique<GuestSource>(std::move(guest));
}

std::unique_ptr<Decoder> GenicamDevice::make_decoder() const { return std::make_unique<ImageDecoder>(decoder()); }

void GenicamDevice::use_only(const std::vector<PixelRegion>& regions) { planes_.use_only(regions, width_, height_); }

PixelRows GenicamDevice::pixel_rows(std::span<const std::byte> packet) const {
  const auto header = decode_image_header(packet);
  if (!header.ok() || payload_ != ImagePayload::Rows) return {};
  const auto format = pixel_format_of(header->pfnc);
  if (!format) return {};
  return {.offset = kImageHeaderSize,
          .stride = header->stride,
          .rows = header->height,
          .colour_rows = rows_of_pattern(*format)};
}

GenicamConfig GenicamDevice::source() const {
  GenicamConfig out = camera_;
  if (payload_ == ImagePayload::Rows) {
    out.width = width_;
    out.height = height_;
    out.pixel_format = pixel_format_;
  } else {  // With JPEG planes the camera sends a buffer of its own size, which is bytes (Mono8) to the transport.
    out.pixel_format = PixelFormat::Mono8;
  }
  return out;
}

ImageDecoder::Config GenicamDevice::decoder() const {
  return {.width = width_, .height = height_, .pixel_format = pixel_format_, .payload = payload_, .planes = planes_};
}

constinit const DeviceType kGenicam{"genicam", Role::Camera, true, make_device<GenicamDevice>};

}  // namespace hueline::drivers
