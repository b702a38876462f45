#include <cstdlib>
#include <string>

#include "drivers/gige/chunk_data.hpp"

// The first byte chooses: the rest is the payload of an image, in either order of bytes, or a description file. Chunks
// lie one behind the other in the payload, and a description loses nothing but the numbers of its ports.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline::drivers;
  if (size == 0) return 0;
  if (data[0] & 1) {
    const auto payload = std::as_bytes(std::span(data + 1, size - 1));
    const std::byte* end = payload.data() + payload.size();
    for (const Chunk& chunk : read_chunks(payload, data[0] & 2 ? std::endian::big : std::endian::little)) {
      if (chunk.data.data() < payload.data() || chunk.data.data() + chunk.data.size() + 8 != end) std::abort();
      end = chunk.data.data();
    }
    return 0;
  }
  const ChunkDescription made = describe_chunks(std::string(reinterpret_cast<const char*>(data + 1), size - 1));
  if (made.ids.empty() != made.text.empty() || made.ids.size() > size) std::abort();
  return 0;
}
