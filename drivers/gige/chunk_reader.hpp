#pragma once

#include <bit>
#include <memory>
#include <span>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/image_packet.hpp"

namespace hueline::drivers {

/// Reads from the chunk data of a GenICam camera how long each image was exposed, and with which gain. Values may be
/// formulas over several chunks and registers, as many cameras have them; Aravis's GenICam calculates them.
/// Thread safety: none; one thread calls all functions.
class ChunkReader {
 public:
  /// Makes the reader of a camera's chunks. Returns null if the camera's description has no exposure among them.
  /// `camera` has to outlive the reader.
  static std::unique_ptr<ChunkReader> make(ArvCamera* camera, std::endian order);
  ~ChunkReader();

  /// Reads the chunks of an image's payload into ImageHeader::exposure and gain. What is not there stays as it is.
  void read(std::span<const std::byte> payload, ImageHeader& header);

 private:
  struct Inside;
  explicit ChunkReader(std::unique_ptr<Inside> inside);
  const std::unique_ptr<Inside> inside_;
};

}  // namespace hueline::drivers
