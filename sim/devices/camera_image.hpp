#pragma once

#include <cstdint>

#include "core/buffer.hpp"
#include "core/result.hpp"

namespace hueline::sim {

/// An image that an emulated camera delivers.
struct CameraImage {
  std::uint64_t sequence = 0;   ///< the camera's count of exposures; a gap becomes a gap in the frame ids
  std::int64_t counter_ns = 0;  ///< time stamp of the stream packets
  std::uint32_t width = 0, height = 0;
  Buffer pixels{};                    ///< width x height bytes
  std::uint32_t missing_packets = 0;  ///< GigE: number of its data packets that are never sent, not even on request
  bool ignores_region = false;        ///< sent whole, whatever region the client has set
  /// What the camera says of the exposure in its chunks. 0: what its registers say.
  std::int64_t exposure_ns = 0;
  float gain = 0;  ///< amplification, a factor
};

/// The chunks that a client has asked for behind the pixels.
struct CameraChunks {
  bool is_active = false, has_exposure = false, has_gain = false;
  bool is_big_endian = true;
  std::int64_t exposure_ns = 0;  ///< by the camera's registers, for an image that says none
  static constexpr std::uint32_t kImageId = 1, kExposureId = 0x0A01, kGainId = 0x0A02;
  static constexpr std::size_t kTailBytes = 8, kExposureBytes = 8, kGainBytes = 4;
  /// Returns the bytes that they add to the pixels.
  std::size_t size() const;
};

/// The part of the sensor that a client has asked for, pixels.
struct CameraRegion {
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
};

/// Returns the bytes of a region of the image: the image itself, or a copy of the part. Reentrant. Errors: Invalid (the
/// image does not hold its pixels, or the region is not inside it).
Result<Buffer> cut_region(const CameraImage& image, const CameraRegion& region);
/// Returns the pixels with the chunks behind them, if the client wants them: the exposure in ns, the gain in 0.01 dB.
Buffer with_chunks(const Buffer& pixels, const CameraImage& image, const CameraChunks& chunks);

}  // namespace hueline::sim
