#include <algorithm>
#include <cstdlib>
#include <span>

#include "tests/drivers/ladybug/ladybug_stream.hpp"

// The input is damage to a stream of three images with padding, and how transfers cut it. Whatever comes, an image has
// the size that it states, no byte is told twice, and no memory stays in use.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  constexpr std::size_t kPacket = 512, kBuffer = 6 * kPacket;
  test::Bytes stream;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const test::Bytes image = test::image_of(i, 1024 + 700 * i);
    stream.insert(stream.end(), image.begin(), image.end());
    stream.resize((i + 1) * kBuffer);
  }
  std::size_t used = 0;
  const auto next = [&]() -> std::size_t { return used < size ? data[used++] : 0; };
  const std::size_t transfer = kPacket * (1 + next() % 8);
  for (std::size_t damages = next() % 16; damages > 0; --damages) {
    const std::size_t at = (next() * 256 + next()) % stream.size();
    stream[at] = static_cast<std::byte>(next());
  }
  test::Memory memory(next() % 4 == 0 ? 1 : 1 << 20);
  std::size_t counted = 0, interruptions = 0, given = 0;
  {
    drivers::LadybugAssembler assembler(kPacket, kBuffer, memory);
    const auto count = [&] {
      const test::Told told = test::pop_all(assembler);
      for (const test::Bytes& image : told.images) {
        if (drivers::ladybug_image_size(image) != image.size()) std::abort();
        counted += image.size();
      }
      for (const Fault& fault : told.faults)
        if (fault.kind == FaultKind::Malformed) counted += fault.count;
    };
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t what = next();
      const std::size_t whole = std::min(transfer, stream.size() - at);
      const std::size_t bytes = what % 4 == 1 ? std::min(whole, next() * 8) : whole;
      assembler.take(std::span(stream).subspan(at, bytes), bytes < whole || what % 4 == 2, host_time_ns(0));
      if (what % 4 == 3) assembler.interrupt("lost", host_time_ns(0)), ++interruptions;
      given += bytes;
      at += whole;
      count();
    }
    assembler.interrupt("the end", host_time_ns(0));
    ++interruptions;
    count();
  }
  if (counted > given + interruptions || memory.bytes_in_use() != 0) std::abort();
  return 0;
}
