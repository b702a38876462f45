// Any bytes, cut anywhere: no crash, every byte counted, and the same messages wherever the cut is.
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "drivers/novatel/decoder.hpp"

using namespace hueline;

namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "novatel_fuzz: %s\n", what);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto all = std::as_bytes(std::span(data, size));
  const auto decode = [&](std::size_t cut) {
    drivers::NovatelDecoder decoder({});
    std::vector<Measurement> out;
    for (const auto part : {all.first(cut), all.subspan(cut)}) {
      Packet packet;
      packet.bytes = Buffer::copy_of(part);
      decoder.decode(packet, out);
    }
    decoder.flush(out);
    require(decoder.held_bytes() == 0, "bytes held after flush");
    const DecodeCounts& counts = decoder.counts();
    require(counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes == size, "bytes do not add up");
    return std::pair(counts, out.size());
  };
  const auto whole = decode(0), cut = decode(size < 2 ? 0 : data[0] * size / 256);
  require(whole.second == cut.second && whole.first.messages == cut.first.messages &&
              whole.first.malformed_bytes == cut.first.malformed_bytes &&
              whole.first.decoded_bytes == cut.first.decoded_bytes,
          "the place of a cut changed what was found");
  return 0;
}
