// Costs of recording and of writing the cloud, each against the plainest thing that moves the same bytes:
//   storage_bench [--benchmark_filter=...]; HUELINE_BENCH_DIR: the folder to write in (default: the temporary folder).
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <stdexcept>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "storage/packed_rows.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/bench.hpp"

namespace {

using namespace hueline;
using namespace hueline::storage;
using Clock = std::chrono::steady_clock;

std::filesystem::path file(const char* suffix) {
  const char* named = std::getenv("HUELINE_BENCH_DIR");
  return (named ? named : std::filesystem::temp_directory_path()) /
         ("hueline_bench_" + std::to_string(::getpid()) + suffix);
}

/// Returns one second of a drive: 10 images of 30 MB (brief: 1 MB), 1500 packets of the laser, 300 of the POS.
std::vector<Packet> one_second() {
  const Buffer image = test::pattern_buffer(test::sized<std::size_t>(30'000'000, 1'000'000), 1),
               laser = test::pattern_buffer(1206, 2), pos = test::pattern_buffer(120, 3);
  std::vector<Packet> packets;
  for (std::uint64_t i = 0; i < 1810; ++i) {
    Packet p;
    p.sequence = i;
    p.received = host_time_ns(static_cast<std::int64_t>(i) * 552'486);
    const bool is_image = i % 181 == 180;
    p.sensor = is_image ? 2 : i % 6 == 5 ? 3 : 1;
    p.bytes = is_image ? image : p.sensor == 3 ? pos : laser;
    packets.push_back(p);
  }
  return packets;
}

/// Returns ten seconds of a drive (brief: one), which are more than what stays in caches.
std::vector<Packet> ten_seconds() {
  std::vector<Packet> packets;
  for (std::uint64_t second = 0; second < test::sized(10u, 1u); ++second)
    for (Packet packet : one_second()) {
      packet.sequence = packets.size();
      packet.received += std::chrono::seconds(second);
      packets.push_back(std::move(packet));
    }
  return packets;
}

std::uint64_t payload_bytes(const std::vector<Packet>& packets) {
  std::uint64_t bytes = 0;
  for (const Packet& p : packets) bytes += p.bytes.size();
  return bytes;
}

double seconds(Clock::time_point from) { return std::chrono::duration<double>(Clock::now() - from).count(); }

/// Writes the same bytes by the same number of write(2) calls, then calls fdatasync.
double plain_write(const std::filesystem::path& path, const std::vector<Packet>& packets) {
  const auto start = Clock::now();
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  for (const Packet& p : packets)
    for (std::size_t done = 0; done < p.bytes.size();) {
      const ssize_t step = ::write(fd, p.bytes.data() + done, p.bytes.size() - done);
      if (step <= 0) throw std::runtime_error("write");
      done += static_cast<std::size_t>(step);
    }
  if (::fdatasync(fd) != 0) throw std::runtime_error("fdatasync");
  ::close(fd);
  return seconds(start);
}

double journal_write(const std::filesystem::path& path, const std::vector<Packet>& packets, Compression compression) {
  JournalWriter::Config config;
  config.if_exists = IfExists::Replace;
  config.compression = compression;
  config.sync_interval = nanoseconds(0);  // once, at the end, as the plain writes do
  const auto start = Clock::now();
  auto writer = JournalWriter::create(path, test::sample_header(), config);
  if (!writer) throw std::runtime_error(writer.error().message);
  for (const Packet& p : packets)
    if (!writer->append(p, test::time_of(p))) throw std::runtime_error("append");
  if (!writer->close()) throw std::runtime_error("close");
  return seconds(start);
}

/// Fails the benchmark unless the journal returns each of these packets.
void expect_written(benchmark::State& state, const std::filesystem::path& path, const std::vector<Packet>& packets) {
  auto reader = JournalReader::open(path);
  std::size_t same = 0;
  if (reader)
    while (auto packet = (*reader)->next({})) {
      if (same == packets.size() || packet->sequence != packets[same].sequence ||
          !std::ranges::equal(packet->bytes.bytes(), packets[same].bytes.bytes()))
        break;
      ++same;
    }
  test::expect(state, same == packets.size(), "the journal gives back every packet");
}

/// ratio: speed of the journal divided by that of plain writes, measured alternately in the same run.
void journal_against_plain_write(benchmark::State& state) {
  const auto packets = one_second();
  const auto path = file(".bin");
  const std::uint64_t bytes = payload_bytes(packets);
  double plain = 0, journal = 0;
  (void)plain_write(path, packets);
  test::expect(state, std::filesystem::file_size(path) == bytes, "the plain way writes the same bytes");
  for (auto _ : state) {
    plain += plain_write(path, packets);
    const double took = journal_write(path, packets, Compression::None);
    journal += took;
    state.SetIterationTime(took);
  }
  expect_written(state, path, packets);
  std::filesystem::remove(path);
  state.counters["ratio"] = plain / journal;
  state.counters["plain_MB/s"] = static_cast<double>(bytes) * 1e-6 * static_cast<double>(state.iterations()) / plain;
  state.counters["journal_MB/s"] =
      static_cast<double>(bytes) * 1e-6 * static_cast<double>(state.iterations()) / journal;
}
BENCHMARK(journal_against_plain_write)->UseManualTime()->Iterations(test::sized(8, 1))->Unit(benchmark::kMillisecond);

/// Processor time of a recording that is larger than what stays in caches, as a share of a core at 300 MB/s of images,
/// beside that of plain writes of the same bytes in the same run.
void journal_processor_time(benchmark::State& state) {
  const auto packets = ten_seconds();
  const std::uint64_t bytes = payload_bytes(packets);
  const auto path = file(".bin");
  // One second of 300 MB; std::clock() counts the time of all threads, with the kernel's.
  const auto share = [&](std::clock_t from) {
    return static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC * 300e6 / static_cast<double>(bytes);
  };
  double plain = 0, journal = 0, took = 0;
  for (auto _ : state) {
    std::filesystem::remove(path);  // else its pages are used again
    std::clock_t from = std::clock();
    (void)plain_write(path, packets);
    plain += share(from);
    std::filesystem::remove(path);
    from = std::clock();
    const double wall = journal_write(path, packets, Compression::None);
    journal += share(from);
    took += wall;
    state.SetIterationTime(wall);
  }
  expect_written(state, path, packets);
  std::filesystem::remove(path);
  const auto runs = static_cast<double>(state.iterations());
  state.counters["core_at_300MB/s"] = journal / runs;
  state.counters["plain_core_at_300MB/s"] = plain / runs;
  state.counters["journal_MB/s"] = static_cast<double>(bytes) * 1e-6 * runs / took;
}
BENCHMARK(journal_processor_time)->UseManualTime()->Iterations(test::sized(3, 1))->Unit(benchmark::kMillisecond);

constexpr std::uint64_t kFioPiece = 4u << 20;

/// Returns the bytes a second at which fio writes a new file in large pieces past the page cache, with the last sync; 0
/// if it failed. `bytes` must be whole pieces.
double fio_rate(const std::filesystem::path& path, std::uint64_t bytes) {
  const std::string command =
      "fio --name=write --rw=write --bs=4M --direct=1 --ioengine=psync --fallocate=none --end_fsync=1 "
      "--output-format=json --filename=" +
      path.string() + " --size=" + std::to_string(bytes);
  std::string said;
  std::FILE* fio = ::popen(command.c_str(), "r");
  if (fio == nullptr) return 0;
  char text[4096];
  while (const std::size_t size = std::fread(text, 1, sizeof text, fio)) said.append(text, size);
  const std::size_t write = said.find("\"write\" :"), rate = said.find("\"bw_bytes\" :", write);
  return ::pclose(fio) == 0 && rate != std::string::npos ? std::strtod(said.c_str() + rate + 12, nullptr) : 0;
}

/// ratio: speed of recording three gigabytes divided by that of fio, alternately in the same run and the same folder.
void journal_against_fio(benchmark::State& state) {
  const auto packets = ten_seconds();
  const std::uint64_t bytes = payload_bytes(packets), whole_pieces = bytes / kFioPiece * kFioPiece;
  const auto path = file(".bin");
  double fio = 0, journal = 0;
  for (auto _ : state) {
    std::filesystem::remove(path);
    const double rate = fio_rate(path, whole_pieces);
    test::expect(state, rate > 0 && std::filesystem::file_size(path) == whole_pieces, "fio writes as many bytes");
    fio += static_cast<double>(bytes) / rate;
    std::filesystem::remove(path);
    const double took = journal_write(path, packets, Compression::None);
    journal += took;
    state.SetIterationTime(took);
  }
  expect_written(state, path, packets);
  std::filesystem::remove(path);
  const double megabytes = static_cast<double>(bytes) * 1e-6 * static_cast<double>(state.iterations());
  state.counters["ratio"] = fio / journal;
  state.counters["fio_MB/s"] = megabytes / fio;
  state.counters["journal_MB/s"] = megabytes / journal;
}
/// Where fio is not installed, there is nothing to compare with.
const bool compares_with_fio = std::system("command -v fio >/dev/null") == 0 &&
                               benchmark::RegisterBenchmark("journal_against_fio", journal_against_fio)
                                       ->UseManualTime()
                                       ->Iterations(test::sized(5, 1))
                                       ->Unit(benchmark::kMillisecond) != nullptr;

/// Measures the cost of a packet, with small packets only.
/// Returns a Bayer image whose noise is that of a bright scene with eight bits.
std::vector<std::byte> bayer_image(const PixelRows& rows) {
  std::vector<std::byte> out(rows.offset + std::size_t{rows.stride} * rows.rows);
  std::uint32_t seed = 1;
  const auto random = [&] { return (seed = seed * 1664525u + 1013904223u) >> 29; };
  for (std::size_t row = 0; row < rows.rows; ++row)
    for (std::size_t i = 0; i < rows.stride; ++i) {
      const std::size_t colour = 40 * (row % 2) + 25 * (i % 2), scene = (row / 16 + i / 8) % 96;
      out[rows.offset + row * rows.stride + i] = static_cast<std::byte>(colour + scene + random() + random());
    }
  return out;
}

/// pack, unpack: bytes a second of an image as a share of those of a memory copy in the same run. zstd: the share of
/// Zstandard at its fastest ordinary level. size, zstd_size: what is left of the image.
void packed_images_against_memory_copy(benchmark::State& state) {
  const std::uint32_t side = test::sized(2048u, 256u);
  const PixelRows rows{64, side, side, 1, 2};
  const auto image = bayer_image(rows);
  const std::vector<Buffer> images(test::sized(8, 2), Buffer::copy_of(image));
  std::vector<std::byte> copy(image.size()), packed(packed_rows_bound(image.size(), rows));
  Bytes zstd;
  double copied = 0, packing = 0, unpacking = 0, compressing = 0;
  std::size_t size = 0;
  bool is_same = true;
  for (auto _ : state) {
    auto start = Clock::now();
    for (const Buffer& one : images) {
      std::memcpy(copy.data(), one.data(), one.size());
      benchmark::DoNotOptimize(copy.data());
      benchmark::ClobberMemory();
    }
    copied += seconds(start);
    start = Clock::now();
    for (const Buffer& one : images) size = pack_rows(one.bytes(), rows, packed);
    packing += seconds(start);
    state.SetIterationTime(seconds(start));
    start = Clock::now();
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto back = unpack_rows(std::span(packed).first(size));
      is_same = is_same && back.ok() && back->payload.size() == image.size();
      if (i == 0 && is_same) is_same = std::ranges::equal(back->payload.bytes(), image);
    }
    unpacking += seconds(start);
    start = Clock::now();
    const ByteView whole(image);
    zstd.clear();
    is_same = is_same && compress(Compression::Zstd, std::span(&whole, 1), zstd).ok();
    compressing += seconds(start) * static_cast<double>(images.size());
  }
  test::expect(state, is_same && size > 0, "the image comes back as it was");
  state.counters["pack"] = copied / packing;
  state.counters["unpack"] = copied / unpacking;
  state.counters["zstd"] = copied / compressing;
  state.counters["size"] = static_cast<double>(size) / static_cast<double>(image.size());
  state.counters["zstd_size"] = static_cast<double>(zstd.size()) / static_cast<double>(image.size());
  state.counters["pack_MB/s"] =
      static_cast<double>(image.size() * images.size()) * 1e-6 * static_cast<double>(state.iterations()) / packing;
}
BENCHMARK(packed_images_against_memory_copy)
    ->UseManualTime()
    ->Iterations(test::sized(20, 1))
    ->Unit(benchmark::kMillisecond);

void journal_small_packets(benchmark::State& state) {
  std::vector<Packet> packets;
  const Buffer laser = test::pattern_buffer(1206, 2);
  for (std::uint64_t i = 0; i < test::sized(100'000u, 1000u); ++i) {
    Packet p;
    p.sequence = i;
    p.sensor = 1;
    p.received = host_time_ns(static_cast<std::int64_t>(i) * 10'000);
    p.bytes = laser;
    packets.push_back(p);
  }
  const auto path = file(".bin");
  for (auto _ : state) state.SetIterationTime(journal_write(path, packets, Compression::None));
  expect_written(state, path, packets);
  std::filesystem::remove(path);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(packets.size()));
}
BENCHMARK(journal_small_packets)->UseManualTime()->Iterations(test::sized(5, 1))->Unit(benchmark::kMillisecond);

void journal_read(benchmark::State& state) {
  const auto packets = one_second();
  const auto path = file(".bin");
  (void)journal_write(path, packets, Compression::None);
  for (auto _ : state) {
    auto reader = JournalReader::open(path);
    std::size_t read = 0;
    while (auto packet = (*reader)->next({})) benchmark::DoNotOptimize(packet->bytes.data()), ++read;
    if (read != packets.size()) throw std::runtime_error("lost packets");
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(std::filesystem::file_size(path)));
  std::filesystem::remove(path);
}
BENCHMARK(journal_read)->Unit(benchmark::kMillisecond);

/// per_copy: time of writing a cloud divided by the time of copying its points in memory.
void las_against_memory_copy(benchmark::State& state) {
  const CloudBlock cloud = test::sample_cloud(test::sized(2'000'000, 20'000));
  std::vector<ColouredPoint> copy(cloud.points.size());
  const auto path = file(".las");
  double copying = 0, writing = 0;
  for (auto _ : state) {
    auto start = Clock::now();
    std::memcpy(static_cast<void*>(copy.data()), cloud.points.data(), cloud.points.size() * sizeof(ColouredPoint));
    benchmark::ClobberMemory();
    copying += seconds(start);
    start = Clock::now();
    auto writer = LasWriter::create(path, cloud.origin, {});
    if (!writer) throw std::runtime_error(writer.error().message);
    if (!writer->append(cloud) || !writer->flush()) throw std::runtime_error("append");
    const double took = seconds(start);
    writing += took;
    state.SetIterationTime(took);
    if (!writer->close()) throw std::runtime_error("close");
  }
  // number of points in the header of LAS 1.4
  std::uint64_t points = 0;
  std::ifstream(path, std::ios::binary).seekg(247).read(reinterpret_cast<char*>(&points), sizeof points);
  test::expect(state, points == cloud.points.size() && std::filesystem::file_size(path) > 30 * points,
               "every point is written");
  std::filesystem::remove(path);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cloud.points.size()));
  state.counters["per_copy"] = writing / copying;
}
BENCHMARK(las_against_memory_copy)->UseManualTime()->Iterations(test::sized(5, 1))->Unit(benchmark::kMillisecond);

/// The same with LAZ or COPC, once with one thread that compresses and once with two. space: bytes of the file divided
/// by those of LAS.
void compressed_against_memory_copy(benchmark::State& state, CloudFormat format) {
  const CloudBlock cloud = test::sample_cloud(test::sized(2'000'000, 120'000));
  std::vector<ColouredPoint> copy(cloud.points.size());
  const auto path = file(".laz");
  double copying = 0, writing = 0;
  for (auto _ : state) {
    auto start = Clock::now();
    std::memcpy(static_cast<void*>(copy.data()), cloud.points.data(), cloud.points.size() * sizeof(ColouredPoint));
    benchmark::ClobberMemory();
    copying += seconds(start);
    start = Clock::now();
    LasWriter::Config config;
    config.format = format;
    config.threads = static_cast<int>(state.range(0));
    auto writer = LasWriter::create(path, cloud.origin, config);
    if (!writer) throw std::runtime_error(writer.error().message);
    if (!writer->append(cloud) || !writer->close()) throw std::runtime_error("append");
    const double took = seconds(start);
    writing += took;
    state.SetIterationTime(took);
  }
  std::uint64_t points = 0;
  auto reader = LasReader::open(path);
  for (std::vector<LasPoint> read; reader && reader->next(read) && !read.empty();) points += read.size();
  test::expect(state, points == cloud.points.size(), "every point is written");
  state.counters["space"] =
      static_cast<double>(std::filesystem::file_size(path)) / static_cast<double>(points * reader->header().point_size);
  std::filesystem::remove(path);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cloud.points.size()));
  state.counters["per_copy"] = writing / copying;
}
BENCHMARK_CAPTURE(compressed_against_memory_copy, laz, CloudFormat::Laz)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Iterations(test::sized(3, 1))
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(compressed_against_memory_copy, copc, CloudFormat::Copc)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Iterations(test::sized(3, 1))
    ->Unit(benchmark::kMillisecond);

}  // namespace
