#pragma once

#include <optional>
#include <string>

#include "core/decoder.hpp"
#include "drivers/gige/image_packet.hpp"

namespace hueline::drivers {

/// Image packets -> Image, without a copy: Image::buffer is the packet's. Pure; one decoder a camera; not thread-safe.
///
/// Faults: a gap of frame ids is Lost with the number of images (16-bit ids wrap past 0); an id that falls is Spurious
/// (the camera restarted) and the image is used; a repeated id is Spurious and dropped. Another width or height than
/// the rig's is WrongSize, another pixel format WrongDevice: no Image then. Broken or cut packets are Malformed.
/// Incomplete images become an Image with is_complete = false and no Fault: the source has said so; one without leader
/// has no number, so it becomes the gap that its successor shows.
class ImageDecoder : public Decoder {
 public:
  struct Config {
    std::uint32_t width = 0, height = 0;        ///< pixels; 0: whatever the camera sends
    std::optional<PixelFormat> pixel_format{};  ///< absent: any that we read
    /// Empty when fine, else a sentence that names the key.
    std::string validate() const;
  };
  explicit ImageDecoder(Config config) : config_(config) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_frame_id_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  /// The image's number against its predecessor's; false: it is that image again.
  bool follow(std::uint64_t frame_id, const Packet& packet, std::vector<Measurement>& out);

  const Config config_;
  std::optional<std::uint64_t> last_frame_id_;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
