#pragma once

#include <optional>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/gige/image_packet.hpp"
#include "drivers/gige/jpeg_planes.hpp"
#include "drivers/gige/planes_decoder.hpp"

namespace hueline::drivers {

/// What an image packet carries after its header.
enum class ImagePayload : std::uint8_t {
  Rows,  ///< rows of pixels
  /// 24 JPEGs (jpeg_planes.hpp). The width, height and pixel format in the packet's header then only describe a block
  /// of bytes.
  JpegPlanes,
};

/// Makes an Image of each image packet. Use one decoder for each camera. Its result depends on the packets and Config
/// only.
/// Thread safety: none; one thread calls all functions.
///
/// - ImagePayload::Rows: Image::buffer is the packet's buffer; nothing is copied.
/// - ImagePayload::JpegPlanes: Image::buffer is the mosaic, which is decoded at once. A lens with a plane that is
///   missing, cut short or broken is lost alone: Image::lost names its rectangle, whose pixels are 0, and a Fault
///   Malformed has the number of such lenses and the reason of the first one. If all lenses are lost, there is no
///   Image. Of an incomplete packet nobody knows which bytes came, so no plane of it is decoded; it becomes an Image
///   without pixels and with is_complete = false.
///
/// Faults:
/// - Lost: a gap of frame ids, with the number of images. 16-bit ids wrap from 65535 to 1.
/// - Spurious: the frame id fell, because the camera restarted (the image is used), or it is the same again (the image
///   is dropped).
/// - WrongSize, WrongDevice: with Rows, the width or height, or the pixel format, is not the rig's. There is no Image.
/// - Malformed: the packet is broken or cut off.
///
/// An incomplete packet becomes an Image with is_complete = false, without a Fault, because the source reports it. A
/// packet without its leader has no frame id; it shows as a gap before the next image.
class ImageDecoder : public Decoder {
 public:
  struct Config {
    std::uint32_t width = 0, height = 0;  ///< pixels; 0 accepts any size
    /// If absent, any format that is read. With JPEG planes it is required: the Bayer format of the mosaic.
    std::optional<PixelFormat> pixel_format{};
    ImagePayload payload = ImagePayload::Rows;
    JpegPlanesLayout planes{};  ///< for ImagePayload::JpegPlanes; width and height are then those of the mosaic
    KeyError validate() const;
  };
  explicit ImageDecoder(Config config);

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_frame_id_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  /// Compares the image's frame id with that of the image before. Returns false if it is the same image again.
  bool follow(std::uint64_t frame_id, const Packet& packet, std::vector<Measurement>& out);

  void take_rows(const ImageHeader& header, const Packet& packet, std::vector<Measurement>& out);
  void take_planes(const ImageHeader& header, const Packet& packet, std::vector<Measurement>& out);

  const Config config_;
  std::optional<std::uint64_t> last_frame_id_;
  PlanesDecoder planes_;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
