#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// The chunk data of a GenICam camera: what it writes behind the pixels of an image to say how the image was made
/// (GenICam SFNC 2.7, chapter 19; layout: GigE Vision 2.2, chapter 28, and USB3 Vision 1.0, chapter 5). Pure functions.
namespace hueline::drivers {

/// A piece of an image's payload. The first one is the pixels.
struct Chunk {
  std::uint32_t id = 0;
  std::span<const std::byte> data;  ///< a part of the payload
};

/// Returns the chunks of a payload, from the last to the first. Each chunk is its data, then its id and the length of
/// its data, 4 bytes each. They are read from the end of the payload; what does not fit ends the list. GigE Vision has
/// big-endian numbers, USB3 Vision little-endian ones.
std::vector<Chunk> read_chunks(std::span<const std::byte> payload, std::endian order);

/// A description file (GenApi XML) in which the features of chunks lie at addresses of the camera's memory, so that
/// they are found as all other features are.
struct ChunkDescription {
  std::string text;
  /// The ids of the chunks. The bytes of chunk i lie at kFirst + i * kApart.
  std::vector<std::uint32_t> ids;
  static constexpr std::uint64_t kFirst = 0x4000'0000'0000'0000, kApart = 0x1'0000'0000;
};
/// Makes it from a camera's description file. Without `ids` the camera has no chunks.
ChunkDescription describe_chunks(const std::string& description);

}  // namespace hueline::drivers
