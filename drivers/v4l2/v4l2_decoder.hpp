#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "drivers/v4l2/motion_jpeg.hpp"
#include "drivers/v4l2/v4l2_packet.hpp"
#include "drivers/v4l2/v4l2_pixels.hpp"

namespace hueline::drivers {

/// Makes an Image of each packet of a V4L2 camera. Use one decoder for each camera. Its result depends on the packets
/// and Config only.
///
/// Image::buffer is the packet's buffer if its pixels can be used as they are; otherwise the pixels are converted
/// (v4l2_pixels.hpp). Image::frame_id continues the driver's sequence beyond 32 bits. Image::time is the buffer's stamp
/// on CLOCK_MONOTONIC, or 0 if the driver does not say which clock it used.
///
/// Faults:
/// - Lost: a gap of the sequence, with the number of images; and an image that the driver flags as damaged, or that has
///   fewer bytes than its rows need. Such an image has no pixels and is_complete = false.
/// - Spurious: the sequence fell, because the driver restarted, or stands still although another image came, because
/// the
///   driver does not count well (in both cases the image is used). Or sequence and stamp are the same again: the image
///   came twice, and is dropped.
/// - WrongSize, WrongDevice: the size or the pixel format is not the rig's. There is no Image.
/// - Malformed: the packet is broken or cut off, or the JPEG in it is. A broken JPEG is an Image without pixels.
/// Thread safety: none; one thread calls all functions.
class V4l2Decoder final : public Decoder {
 public:
  struct Config {
    std::uint32_t width = 0, height = 0;  ///< pixels
    std::uint32_t fourcc = 0;             ///< one of v4l2_formats()
  };
  explicit V4l2Decoder(Config config) : config_(config), converted_(std::numeric_limits<std::size_t>::max()) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  /// Compares the image with the one before and finds its number. Returns nothing if it is the same image again.
  std::optional<std::uint64_t> follow(const V4l2Header& header, const Packet& packet, std::vector<Measurement>& out);
  /// Fills in the pixels of `image`. Returns why it cannot, or an empty text.
  std::string take_pixels(const V4l2Format& format, const V4l2Header& header, const Packet& packet, Image& image);
  std::string take_jpeg(const Packet& packet, Image& image);

  const Config config_;
  struct Last {
    std::uint32_t sequence;
    nanoseconds stamp;
    std::uint64_t frame_id;
  };
  std::optional<Last> last_;
  MotionJpegDecoder jpeg_;
  BufferPool converted_;  // grows with the number of images that are held; released ones are reused
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
