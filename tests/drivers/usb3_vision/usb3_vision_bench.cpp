// The images of a USB3 Vision camera put together from the transfers of its endpoint, against a copy of the same bytes.
// An image has 30 MB, as that of a head with six lenses, and a transfer 256 kB.
#include <algorithm>
#include <cstring>
#include <span>

#include "tests/drivers/packet_pool.hpp"
#include "tests/drivers/usb3_vision/u3v_stream.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline;

const std::uint32_t kWidth = test::sized<std::uint32_t>(6144, 256), kHeight = test::sized<std::uint32_t>(4880, 128);
constexpr std::size_t kPacket = 1024, kTransfer = 256u << 10;
const std::size_t kPixels = std::size_t{kWidth} * kHeight;

const test::Bytes& pixels() {
  static const test::Bytes made = test::u3v_pixels(1, kPixels);
  return made;
}
void note(benchmark::State& state) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(kPixels));
  state.SetItemsProcessed(state.iterations());
}

void copy(benchmark::State& state) {
  test::Memory memory(64u << 20);
  MutableBuffer to = memory.acquire(kPixels);
  for (auto _ : state) {
    std::memcpy(to.data(), pixels().data(), kPixels);
    benchmark::ClobberMemory();
  }
  test::expect(state, std::memcmp(to.data(), pixels().data(), kPixels) == 0, "the image is copied");
  note(state);
}
BENCHMARK(copy)->Unit(benchmark::kMillisecond);

void assemble(benchmark::State& state) {
  test::Memory memory(64u << 20);
  drivers::U3vAssembler assembler({.packet_bytes = kPacket, .payload_bytes = kPixels}, memory);
  const sim::U3vImage image = test::u3v_image(1, kWidth, kHeight);
  const test::Bytes leader = sim::encode_u3v_leader(image), trailer = sim::encode_u3v_trailer(image, kPixels);
  std::size_t images = 0;
  bool is_same = true;
  for (auto _ : state) {
    assembler.take(leader, true, HostTime{});
    for (std::size_t at = 0; at < kPixels; at += kTransfer) {
      const std::size_t piece = std::min(kTransfer, kPixels - at);
      assembler.take(std::span(pixels()).subspan(at, piece), piece % kPacket != 0, HostTime{});
    }
    assembler.take(trailer, true, HostTime{});
    const auto packet = assembler.pop();
    if (!packet) break;
    if (images++ == 0) is_same = std::ranges::equal(packet->bytes.bytes().subspan(drivers::kImageHeaderSize), pixels());
  }
  test::expect(state, is_same && images == static_cast<std::size_t>(state.iterations()) && !assembler.pop(),
               "each turn gives its image");
  note(state);
}
BENCHMARK(assemble)->Unit(benchmark::kMillisecond);

}  // namespace
