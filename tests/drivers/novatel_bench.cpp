// Decoding against the least that any decoder has to do: one CRC-32 pass over the same bytes.
#include <benchmark/benchmark.h>
#include <libdeflate.h>

#include "drivers/novatel/decoder.hpp"
#include "tests/drivers/novatel_encoder.hpp"

namespace {

using namespace hueline;

/// A second of a busy receiver: 200 INSPVAS, one each of the slow ones.
test::Bytes one_second() {
  test::Bytes all;
  for (int k = 0; k < 200; ++k) {
    const test::Bytes m = test::inspvas({.seconds = 100 + k * 0.005, .latitude_deg = 48, .longitude_deg = 11});
    all.insert(all.end(), m.begin(), m.end());
  }
  const test::Bytes mark = test::mark_time(1130, 2300, 100.5);
  all.insert(all.end(), mark.begin(), mark.end());
  return all;
}

void crc_only(benchmark::State& state) {
  const test::Bytes bytes = one_second();
  for (auto _ : state) benchmark::DoNotOptimize(libdeflate_crc32(0, bytes.data(), bytes.size()));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(bytes.size()));
}

void decode(benchmark::State& state) {
  const test::Bytes bytes = one_second();
  std::vector<Packet> packets;
  const auto piece = static_cast<std::size_t>(state.range(0));
  for (std::size_t at = 0; at < bytes.size(); at += piece)
    packets.push_back(test::packet_of(std::span(bytes).subspan(at, std::min(piece, bytes.size() - at))));
  drivers::NovatelDecoder decoder({});
  std::vector<Measurement> out;
  for (auto _ : state) {
    out.clear();
    for (const Packet& packet : packets) decoder.decode(packet, out);
    benchmark::DoNotOptimize(out.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(bytes.size()));
}

/// A second of random bytes: resynchronisation at every one.
void decode_noise(benchmark::State& state) {
  test::Bytes bytes(20000);
  std::uint32_t x = 1;
  for (auto& b : bytes) b = static_cast<std::byte>((x = x * 1664525u + 1013904223u) >> 24);
  const Packet packet = test::packet_of(bytes);
  drivers::NovatelDecoder decoder({});
  std::vector<Measurement> out;
  for (auto _ : state) {
    out.clear();
    decoder.decode(packet, out);
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(bytes.size()));
}

/// A hostile one: headers every ten bytes, each of which claims the next 32 kB. `hashed_per_byte` says why it is no slower.
void frame_nested_lengths(benchmark::State& state) {
  struct Nothing : drivers::NovatelFramer::Sink {
    void on_message(const drivers::NovatelMessage&) override {}
    void on_text(std::string_view, HostTime) override {}
    void on_skipped(std::uint64_t, std::uint64_t, std::uint16_t, HostTime) override {}
  } sink;
  const test::Bytes header = test::long_message(4000, 2300, 0, test::Bytes(32000));
  test::Bytes bytes;
  while (bytes.size() < 1460 * 100) bytes.insert(bytes.end(), header.begin(), header.begin() + 10);
  drivers::NovatelFramer framer({});
  std::uint64_t fed = 0;
  for (auto _ : state)
    for (std::size_t at = 0; at < bytes.size(); at += 1460, fed += 1460) framer.feed(std::span(bytes).subspan(at, 1460), {}, sink);
  state.SetBytesProcessed(static_cast<std::int64_t>(fed));
  state.counters["hashed_per_byte"] = static_cast<double>(framer.bytes_hashed()) / static_cast<double>(fed);
}

BENCHMARK(crc_only);
BENCHMARK(decode)->Arg(104)->Arg(1460)->Arg(16384);
BENCHMARK(decode_noise);
BENCHMARK(frame_nested_lengths);

}  // namespace
