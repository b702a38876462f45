// The images of a Ladybug put together from the transfers of its endpoint, against a copy of the same bytes. An image
// has 3.4 MB, as a Ladybug5's at quality 85, in a buffer of 8 MB, and a transfer 256 kB.
#include <algorithm>
#include <cstring>
#include <span>

#include "tests/drivers/ladybug/ladybug_stream.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline;

const std::size_t kImage = test::sized<std::size_t>(3'400'000, 34'000),
                  kBuffer = test::sized<std::size_t>(8u << 20, 80 << 10);
constexpr std::size_t kPacket = 1024, kTransfer = 256u << 10;

const test::Bytes& buffer() {
  static const test::Bytes made = [] {
    test::Bytes out = test::image_of(1, kImage);
    out.resize(kBuffer);
    return out;
  }();
  return made;
}
void note(benchmark::State& state) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(kImage));
  state.SetItemsProcessed(state.iterations());
}

void copy(benchmark::State& state) {
  test::Memory memory(64u << 20);
  MutableBuffer to = memory.acquire(kImage);
  for (auto _ : state) {
    std::memcpy(to.data(), buffer().data(), kImage);
    benchmark::ClobberMemory();
  }
  test::expect(state, std::memcmp(to.data(), buffer().data(), kImage) == 0, "the image is copied");
  note(state);
}
BENCHMARK(copy)->Unit(benchmark::kMicrosecond);

void assemble(benchmark::State& state) {
  test::Memory memory(64u << 20);
  drivers::LadybugAssembler assembler(kPacket, kBuffer, memory);
  std::size_t images = 0;
  bool is_same = true;
  for (auto _ : state) {
    for (std::size_t at = 0; at < kBuffer; at += kTransfer)
      assembler.take(std::span(buffer()).subspan(at, std::min(kTransfer, kBuffer - at)), false, HostTime{});
    const auto packet = assembler.pop();
    if (!packet) break;
    if (images++ == 0) is_same = std::ranges::equal(packet->bytes.bytes(), std::span(buffer()).first(kImage));
  }
  test::expect(state, is_same && images == static_cast<std::size_t>(state.iterations()) && !assembler.pop(),
               "each buffer gives its image");
  note(state);
}
BENCHMARK(assemble)->Unit(benchmark::kMicrosecond);

}  // namespace
