#include <algorithm>
#include <cstdlib>
#include <span>

#include "tests/drivers/packet_pool.hpp"
#include "tests/drivers/usb3_vision/u3v_stream.hpp"

// The input is damage to a stream of images, and how transfers cut it. Whatever comes, an image has the size that its
// header states, no byte is told twice, and no memory stays in use.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  constexpr std::size_t kPacket = 512, kPayload = 1700;
  std::size_t used = 0;
  const auto next = [&]() -> std::size_t { return used < size ? data[used++] : 0; };
  test::Memory memory(next() % 4 == 0 ? 1 : 1 << 16);
  std::size_t told = 0, given = 0, interruptions = 0;
  {
    drivers::U3vAssembler assembler({.packet_bytes = kPacket, .payload_bytes = kPayload, .padding_bytes = next() * 8},
                                    memory);
    const auto count = [&] {
      const test::U3vTold out = test::pop_all(assembler);
      for (const auto& image : out.images) {
        if (image.pixels.size() != std::min<std::uint64_t>(image.header.pixel_bytes(), kPayload)) std::abort();
        if (image.header.status == drivers::ImageStatus::Complete) told += image.pixels.size();
      }
      for (const Fault& fault : out.faults)
        if (fault.kind == FaultKind::Malformed) told += fault.count;
    };
    const auto give = [&](test::Bytes bytes) {
      for (std::size_t damages = next() % 8; damages > 5 && !bytes.empty(); --damages)
        bytes[next() * bytes.size() / 256] = static_cast<std::byte>(next());
      const std::size_t transfer = kPacket * (1 + next() % 4);
      for (std::size_t at = 0; at < bytes.size(); at += transfer) {
        const std::size_t what = next();
        std::size_t piece = std::min(transfer, bytes.size() - at);
        if (what % 16 == 1) piece = std::min(piece, next());
        assembler.take(std::span(bytes).subspan(at, piece), piece < transfer || what % 16 == 2, host_time_ns(0));
        given += piece;
        if (what % 16 == 3) assembler.interrupt("lost", host_time_ns(0)), ++interruptions;
      }
      count();
    };
    for (std::uint64_t number = 0; number < 4; ++number) {
      const sim::U3vImage image = test::u3v_image(number, 100, 17);
      const std::size_t what = next();
      if (what % 8 != 1) give(sim::encode_u3v_leader(image));
      if (what % 8 != 2) give(test::u3v_pixels(number, kPayload));
      if (what % 8 != 3) give(sim::encode_u3v_trailer(image, kPayload));
    }
    assembler.interrupt("the end", host_time_ns(0));
    ++interruptions;
    count();
  }
  // A payload that is no image is told as one, too.
  if (told > given + interruptions + 8 || memory.bytes_in_use() != 0) std::abort();
  return 0;
}
