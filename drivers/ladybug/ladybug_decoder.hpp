#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/gige/jpeg_planes.hpp"
#include "drivers/gige/planes_decoder.hpp"

namespace hueline::drivers {

/// Makes an Image of each image of a Ladybug (ladybug_image.hpp), whose planes it joins to one mosaic. Its result
/// depends on the packets and Config only. The head of a stream file and its GPS summary are ignored.
///
/// Faults:
/// - Lost: a gap of the sequence, with the number of images.
/// - Spurious: the sequence fell, because the camera restarted (the image is used), or it is the same again (the image
///   is dropped).
/// - WrongDevice: the image is of a camera with another serial number than the rig's. There is no Image.
/// - Malformed: the image is broken, or the planes of a lens are (PlanesDecoder).
/// Thread safety: none; one thread calls all functions.
class LadybugDecoder final : public Decoder {
 public:
  /// The stamp of an image that becomes Image::time.
  enum class Stamp : std::uint8_t {
    None,
    /// Seconds and microseconds since 1970-01-01, UTC. Each image then also gives a TimedArrival, by which files of
    /// several recorders are put in order.
    Utc,
    Unix,   ///< the same fields, of a clock that nothing ties to UTC
    Cycle,  ///< the cycle time of the bus, which wraps after 128 s
  };
  struct Config {
    std::uint32_t width = 0, height = 0;  ///< of the mosaic, pixels
    PixelFormat pixel_format = PixelFormat::BayerRG8;
    JpegPlanesLayout planes{};
    Stamp stamp = Stamp::None;
    std::uint32_t serial = 0;  ///< serial number of the head; 0: any

    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit LadybugDecoder(Config config);

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override { last_sequence_.reset(); }
  const DecodeCounts& counts() const override { return counts_; }

 private:
  bool follow(std::uint32_t sequence, const Packet& packet, std::vector<Measurement>& out);

  const Config config_;
  std::optional<std::uint32_t> last_sequence_;
  PlanesDecoder planes_;
  DecodeCounts counts_;
};

}  // namespace hueline::drivers
