#pragma once

#include <optional>
#include <string>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/gige/bayer_jpeg.hpp"
#include "drivers/gige/image_packet.hpp"
#include "drivers/gige/jpeg_planes.hpp"

namespace hueline::drivers {

/// What stands where an image packet has its pixels.
enum class ImagePayload : std::uint8_t {
  Rows,        ///< the pixels
  JpegPlanes,  ///< 24 JPEGs (jpeg_planes.hpp); the packet's own width, height and pixel format are those of a heap of
               ///< bytes
};

/// Image packets -> Image. Pure; one decoder a camera; not thread-safe.
///
/// Rows: without a copy, Image::buffer is the packet's. JPEG planes: Image::buffer is the mosaic, decoded at once. A
/// lens with a plane that is missing, cut short or broken is lost by itself: Malformed, with the number of such lenses
/// and the first one's reason, and Image::lost names its rectangle, whose pixels are 0. Only if no lens is left there
/// is no Image. Of an incomplete packet nobody knows which bytes came, so none of its planes is decoded: an Image
/// without pixels and with is_complete = false.
///
/// Faults: a gap of frame ids is Lost with the number of images (16-bit ids wrap past 0); an id that falls is Spurious
/// (the camera restarted) and the image is used; a repeated id is Spurious and dropped. Another width or height than
/// the rig's is WrongSize, another pixel format WrongDevice: no Image then. Broken or cut packets are Malformed.
/// Incomplete images become an Image with is_complete = false and no Fault: the source has said so; one without leader
/// has no number, so it becomes the gap that its successor shows.
class ImageDecoder : public Decoder {
 public:
  struct Config {
    std::uint32_t width = 0, height = 0;  ///< pixels; 0: whatever the camera sends
    /// Absent: any that we read. With JPEG planes, of the mosaic that they make: one of the Bayer formats.
    std::optional<PixelFormat> pixel_format{};
    ImagePayload payload = ImagePayload::Rows;
    JpegPlanesLayout planes{};  ///< with ImagePayload::JpegPlanes; width and height are then those of the mosaic
    KeyError validate() const;
  };
  explicit ImageDecoder(Config config);

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_frame_id_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  /// The image's number against its predecessor's; false: it is that image again.
  bool follow(std::uint64_t frame_id, const Packet& packet, std::vector<Measurement>& out);

  void take_rows(const ImageHeader& header, const Packet& packet, std::vector<Measurement>& out);
  void take_planes(const ImageHeader& header, const Packet& packet, std::vector<Measurement>& out);
  /// Why a lens is lost; empty: it is not.
  std::string decode_lens(std::size_t lens, const JpegPlanes& planes, std::uint8_t* mosaic);
  PixelRegion region_of(std::size_t lens) const;

  const Config config_;
  std::optional<std::uint64_t> last_frame_id_;
  BayerJpegDecoder jpeg_;
  BufferPool mosaics_;  // as many as their holders hold; freed ones are used again
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
