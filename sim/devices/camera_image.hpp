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
  Buffer pixels;                      ///< width x height bytes
  std::uint32_t missing_packets = 0;  ///< GigE: number of its data packets that are never sent, not even on request
  bool ignores_region = false;        ///< sent whole, whatever region the client has set
};

/// The part of the sensor that a client has asked for, pixels.
struct CameraRegion {
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
};

/// Returns the bytes of a region of the image: the image itself, or a copy of the part. Reentrant. Errors: Invalid (the
/// image does not hold its pixels, or the region is not inside it).
Result<Buffer> cut_region(const CameraImage& image, const CameraRegion& region);

}  // namespace hueline::sim
