// Decoding compared with the least that any decoder has to do: one CRC-32 pass over the same bytes.
#include <libdeflate.h>

#include <algorithm>
#include <utility>

#include "drivers/novatel/decoder.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline;

/// One second of a busy receiver: 200 INSPVAS, and one of each slow log.
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

template <class Kind>
std::ptrdiff_t count(const std::vector<Measurement>& all) {
  return std::count_if(all.begin(), all.end(), [](const Measurement& m) { return std::holds_alternative<Kind>(m); });
}

void crc_only(benchmark::State& state) {
  const test::Bytes bytes = one_second();
  std::uint32_t crc = 0;
  for (auto _ : state) {
    crc = libdeflate_crc32(0, bytes.data(), bytes.size());
    benchmark::DoNotOptimize(std::as_const(crc));  // Google Benchmark 1.7 may change what it may write to
  }
  const std::size_t half = bytes.size() / 2;
  test::expect(
      state, crc == libdeflate_crc32(libdeflate_crc32(0, bytes.data(), half), bytes.data() + half, bytes.size() - half),
      "all bytes are summed");
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
  std::ptrdiff_t marks = 0;  // the decoder passes on each mark once, however often the same bytes come
  for (auto _ : state) {
    out.clear();
    for (const Packet& packet : packets) decoder.decode(packet, out);
    marks += count<EventMark>(out);
    benchmark::DoNotOptimize(out.data());
  }
  test::expect(state,
               count<InsSolution>(out) == 200 && marks == 1 &&
                   decoder.counts().decoded_bytes == static_cast<std::uint64_t>(state.iterations()) * bytes.size(),
               "every message is decoded");
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(bytes.size()));
}

/// One second of random bytes: the framer searches at every one of them.
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
  const DecodeCounts& counts = decoder.counts();
  const auto fed = static_cast<std::uint64_t>(state.iterations()) * bytes.size();
  // Bytes that may begin a message are held for the next call.
  test::expect(state,
               counts.decoded_bytes == 0 && counts.malformed_bytes + counts.ignored_bytes > fed - bytes.size() / 2,
               "the noise is passed over");
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(bytes.size()));
}

/// One second of hostile bytes: headers every ten bytes, each of which claims the next 32 kB. `hashed_per_byte` shows
/// why this is not slower.
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
    for (std::size_t at = 0; at < bytes.size(); at += 1460, fed += 1460)
      framer.feed(std::span(bytes).subspan(at, 1460), {}, sink);
  state.SetBytesProcessed(static_cast<std::int64_t>(fed));
  state.counters["hashed_per_byte"] = static_cast<double>(framer.bytes_hashed()) / static_cast<double>(fed);
  test::expect(state, framer.bytes_hashed() > fed / 2 && framer.bytes_hashed() <= 2 * fed,
               "each byte is hashed once, or twice at most");
}

BENCHMARK(crc_only);
BENCHMARK(decode)->Arg(104)->Arg(1460)->Arg(16384);
BENCHMARK(decode_noise);
BENCHMARK(frame_nested_lengths);

}  // namespace
