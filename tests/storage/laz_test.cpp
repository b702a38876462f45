#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "storage/laz_chunk.hpp"
#include "storage/laz_format.hpp"
#include "tests/storage/cloud_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::records_of;
using test::sample_cloud;
using test::sample_origin;
using test::TemporaryFolder;
using test::write_cloud;

LasWriter::Config compressed(int threads = 1, std::uint64_t header_every = 1'000'000) {
  LasWriter::Config config;
  config.created = {2026, 3, 1, 12, 0, 0, 0};
  config.format = CloudFormat::Laz;
  config.threads = threads;
  config.header_every = header_every;
  return config;
}

/// Records of the formats 0 to 3, as wild_records(): returns of pulses that follow each other, and whatever a byte
/// holds.
Bytes wild_old_records(const LazRecord& kind, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  const auto often = [&](unsigned one_in) { return random() % one_in == 0; };
  Bytes records(count * kind.size);
  double time = 3.1e8;
  const std::size_t colour = kind.format == 2 ? 20 : kind.format == 3 ? 28 : 0, extra = las_point_size(kind.format);
  for (std::size_t i = 0; i < count; ++i) {
    const std::span<std::byte> r = std::span(records).subspan(i * kind.size, kind.size);
    const auto n = static_cast<double>(i);
    put(r, 0, often(900) ? static_cast<std::int32_t>(random()) : static_cast<std::int32_t>(1e5 * std::sin(n * 0.01)));
    put(r, 4,
        often(900) ? INT32_MIN
                   : static_cast<std::int32_t>(3e5 * std::cos(n * 0.003)) + static_cast<std::int32_t>(random() % 9));
    put(r, 8, static_cast<std::int32_t>(random() % 5000) - 2500);
    put(r, 12, static_cast<std::uint16_t>(often(4) ? random() : 700));
    const unsigned returns = 1 + static_cast<unsigned>(random()) % 5;
    const unsigned usual =
        (1 + static_cast<unsigned>(random()) % returns) | returns << 3 | (i / 700 % 2 == 0 ? 0u : 1u << 6);
    put(r, 14, static_cast<std::uint8_t>(often(50) ? random() : often(2) ? usual : 9));
    put(r, 15, static_cast<std::uint8_t>(often(40) ? random() : random() % 7));
    put(r, 16, static_cast<std::int8_t>(often(9) ? random() : i / 50));
    put(r, 17, static_cast<std::uint8_t>(often(3) ? random() % 3 * 80 : 0));
    put(r, 18, static_cast<std::uint16_t>(often(20) ? random() : 7));
    if (often(2)) time += 55.296e-6 * (often(5) ? static_cast<double>(random() % 700) - 30 : 1);
    if (kind.format & 1)
      put(r, 20,
          often(300)  ? std::bit_cast<double>(std::uint64_t{random()} << 32 | random())
          : often(99) ? -0.0
                      : time);
    if (colour != 0) {
      for (std::size_t at = colour; at < colour + 6; ++at)
        r[at] = static_cast<std::byte>(random() % (often(5) ? 256 : 3));
      if (often(3)) r[colour + 2] = r[colour + 4] = r[colour], r[colour + 3] = r[colour + 5] = r[colour + 1];  // grey
    }
    for (std::size_t at = extra; at < kind.size; ++at) r[at] = static_cast<std::byte>(at % 2 == 0 ? 5 : random());
  }
  return records;
}

/// Records in which every field takes ordinary and rare values, with jumps, also of the times.
Bytes wild_records(const LazRecord& kind, std::size_t count, unsigned seed) {
  if (!kind.is_layered()) return wild_old_records(kind, count, seed);
  std::mt19937 random(seed);
  const auto often = [&](unsigned one_in) { return random() % one_in == 0; };
  Bytes records(count * kind.size);
  double time = 1e8;
  for (std::size_t i = 0; i < count; ++i) {
    const std::span<std::byte> r = std::span(records).subspan(i * kind.size, kind.size);
    const auto n = static_cast<double>(i);
    put(r, 0, often(900) ? static_cast<std::int32_t>(random()) : static_cast<std::int32_t>(1e5 * std::sin(n * 0.01)));
    put(r, 4,
        often(900) ? INT32_MIN
                   : static_cast<std::int32_t>(3e5 * std::cos(n * 0.003)) + static_cast<std::int32_t>(random() % 9));
    put(r, 8, static_cast<std::int32_t>(random() % 5000) - 2500);
    put(r, 12, static_cast<std::uint16_t>(random() % 256 * 257));
    const unsigned returns = 1 + static_cast<unsigned>(random()) % 5;
    const unsigned usual = (1 + static_cast<unsigned>(random()) % returns) | returns << 4;
    put(r, 14, static_cast<std::uint8_t>(often(50) ? random() : usual));
    put(r, 15, static_cast<std::uint8_t>(0x10 | (often(9) ? random() & 0xCF : 0)));
    put(r, 16, static_cast<std::uint8_t>(often(40) ? random() : random() % 7));
    put(r, 17, static_cast<std::uint8_t>(random() % 3 * 80));
    put(r, 18, static_cast<std::int16_t>(often(3) ? random() : 100));
    put(r, 20, static_cast<std::uint16_t>(often(20) ? random() : 1 + random() % 3));
    if (often(2)) time += 55.296e-6 * (often(5) ? static_cast<double>(random() % 700) - 30 : 1);
    put(r, 22, often(300) ? std::bit_cast<double>(std::uint64_t{random()} << 32 | random()) : often(99) ? -0.0 : time);
    for (std::size_t at = 30; at < kind.size; ++at)
      r[at] = static_cast<std::byte>(at % 3 == 0 ? 5 : at % 3 == 1 ? random() % 4 : random());
    if (kind.format >= 7 && often(3)) r[32] = r[34] = r[30], r[33] = r[35] = r[31];  // grey
  }
  return records;
}

TEST(LazChunk, GivesBackEveryRecordOfEveryFormat) {
  for (const LazRecord kind :
       {LazRecord{6, 30}, LazRecord{6, 31}, LazRecord{7, 36}, LazRecord{7, 58}, LazRecord{8, 38}, LazRecord{8, 47},
        LazRecord{0, 20}, LazRecord{0, 22}, LazRecord{1, 28}, LazRecord{2, 26}, LazRecord{3, 34}, LazRecord{3, 45}})
    for (const std::size_t count : {1u, 2u, 3u, 512u, 513u, 514u, 20'000u}) {
      const Bytes records = wild_records(kind, count, static_cast<unsigned>(count));
      const Bytes chunk = encode_laz_chunk(records, kind);
      Bytes back;
      const auto decoded = decode_laz_chunk(chunk, kind, count, back);
      ASSERT_TRUE(decoded) << decoded.error().message;
      EXPECT_TRUE(back == records) << "format " << kind.format << ", " << kind.size << " bytes, " << count << " points";
      if (count > 1) {
        EXPECT_EQ(*decoded, chunk.size());
      }
      if (!kind.is_layered()) continue;
      const LazChunkSize size = measure_laz_chunk(chunk, kind);
      EXPECT_EQ(size.points, count);
      EXPECT_EQ(size.bytes, chunk.size());
      EXPECT_FALSE(decode_laz_chunk(chunk, kind, count - 1, back)) << "more points than are allowed";
    }
}

TEST(LazChunk, GivesBackTheRecordsOfSeveralScannerChannels) {
  for (const int version : {3, 4})
    for (const LazRecord kind : {LazRecord{6, 30, version}, LazRecord{7, 40, version}, LazRecord{8, 41, version}}) {
      Bytes records = wild_records(kind, 5000, 7);
      std::mt19937 random(8);
      for (std::size_t i = 0, channel = 2; i < 5000; ++i) {
        // Runs of one channel, and then from record to record.
        if (random() % (i < 2500 ? 60 : 2) == 0) channel = random() % 4;
        std::byte& flags = records[i * kind.size + 15];
        flags = (flags & std::byte{0xCF}) | static_cast<std::byte>(channel << 4);
      }
      Bytes back;
      const Bytes chunk = encode_laz_chunk(records, kind);
      const auto decoded = decode_laz_chunk(chunk, kind, 5000, back);
      ASSERT_TRUE(decoded) << decoded.error().message;
      EXPECT_TRUE(back == records) << "format " << kind.format << ", items of version " << version;
    }
}

TEST(LazChunk, ADamagedChunkIsAnErrorOrOtherPoints) {
  for (const LazRecord kind : {LazRecord{7, 40}, LazRecord{3, 36}}) {
    const Bytes whole = encode_laz_chunk(wild_records(kind, 700, 3), kind);
    std::mt19937 random(4);
    Bytes back;
    for (int i = 0; i < 300; ++i) {
      Bytes damaged = whole;
      for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<std::byte>(random());
      if (decode_laz_chunk(damaged, kind, kind.is_layered() ? 1000 : 700, back)) {
        EXPECT_EQ(back.size() % kind.size, 0u);
      }
      // The last two or three bytes of a coder are zeros, as are bytes that are not there.
      damaged.assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(random() % (whole.size() - 4)));
      EXPECT_FALSE(decode_laz_chunk(damaged, kind, 700, back)) << "cut to " << damaged.size() << " bytes";
    }
  }
}

TEST(LazFormat, GivesBackTheTable) {
  const std::vector<LazChunkSize> chunks{{700'000, 50'000}, {1, 1}, {0xFFFFFFFF, 0xFFFFFFFE}, {700'001, 50'000}};
  for (const bool has_points : {false, true}) {
    const auto back = decode_laz_table(encode_laz_table(chunks, has_points), has_points, 4);
    ASSERT_TRUE(back);
    ASSERT_EQ(back->size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ((*back)[i].bytes, chunks[i].bytes);
      EXPECT_EQ((*back)[i].points, has_points ? chunks[i].points : 0);
    }
    EXPECT_FALSE(decode_laz_table(encode_laz_table(chunks, has_points), has_points, 3));
  }
}

TEST(Laz, HasTheRecordsOfTheLasFileInHalfTheSpace) {
  const TemporaryFolder folder;
  const CloudBlock cloud = sample_cloud(120'000);
  LasWriter::Config plain = compressed();
  plain.format = CloudFormat::Las;
  write_cloud(folder / "cloud.las", cloud, plain);
  const Bytes records = records_of(folder / "cloud.las");
  ASSERT_EQ(records.size(), 120'000u * 58);
  write_cloud(folder / "cloud.laz", cloud, compressed());
  for (const std::size_t step : {1000u, 65536u, 500'000u}) {
    Status end;
    EXPECT_TRUE(records_of(folder / "cloud.laz", end, step) == records) << "in steps of " << step;
    EXPECT_TRUE(end);
  }
  EXPECT_LT(std::filesystem::file_size(folder / "cloud.laz"), std::filesystem::file_size(folder / "cloud.las") / 2);
  for (const int threads : {2, 3}) {
    write_cloud(folder / "more.laz", cloud, compressed(threads));
    EXPECT_TRUE(test::bytes_of(folder / "more.laz") == test::bytes_of(folder / "cloud.laz")) << threads << " threads";
  }
}

TEST(Laz, AnEmptyCloudIsAFileToo) {
  const TemporaryFolder folder;
  for (const std::uint64_t header_every : {std::uint64_t{1000}, LasWriter::Config::kOnlyAtTheEnd}) {
    write_cloud(folder / "cloud.laz", {sample_origin(), {}}, compressed(1, header_every));
    EXPECT_TRUE(records_of(folder / "cloud.laz").empty());
  }
}

TEST(Laz, AKilledWriterLeavesAFileThatReadsToItsLastHeader) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.laz";
  ASSERT_EQ(test::status_of_killed([&] {
              auto writer = LasWriter::create(path, sample_origin(), compressed(1, 60'000));
              for (std::size_t i = 0; i < 36; ++i)
                if (!writer->append(sample_cloud(5'000, i * 5'000))) return 1;
              ::_exit(0);  // the writer is not closed
            }),
            0);
  write_cloud(folder / "whole.laz", sample_cloud(180'000), compressed());
  const Bytes whole = records_of(folder / "whole.laz");
  const Bytes read = records_of(path);
  EXPECT_EQ(LasReader::open(folder / "whole.laz")->header().generating_software, "hueline");
  EXPECT_EQ(LasReader::open(path)->header().generating_software, kLasUnfinished);
  ASSERT_EQ(read.size(), 150'000u * 58) << "the last update came at 180 000 points, when three chunks were full";
  EXPECT_TRUE(std::equal(read.begin(), read.end(), whole.begin()));
}

TEST(Laz, ACutFileReadsToItsLastWholeChunk) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.laz";
  write_cloud(path, sample_cloud(220'000), compressed());
  const Bytes whole = records_of(path);
  const auto size = std::filesystem::file_size(path);
  std::size_t last = whole.size();
  for (const double part : {0.9999, 0.9, 0.7, 0.5, 0.3, 0.1}) {
    std::filesystem::resize_file(path, static_cast<std::uintmax_t>(part * static_cast<double>(size)));
    Status end;
    const Bytes read = records_of(path, end);
    EXPECT_EQ(end.error().code, ErrorCode::Truncated);
    EXPECT_LE(read.size(), last);
    EXPECT_EQ(read.size() % (50'000 * 58), read.size() == whole.size() ? 20'000u * 58 : 0u);
    EXPECT_GE(read.size() + 50'000 * 58, static_cast<std::size_t>(part * static_cast<double>(whole.size()))) << part;
    EXPECT_TRUE(std::equal(read.begin(), read.end(), whole.begin()));
    last = read.size();
    if (last == whole.size()) continue;
  }
}

TEST(Laz, WhatWasWrittenBeforeARefusedWriteReads) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.laz";
  ASSERT_EQ(test::status_of_killed([&] { return test::write_into_limit(path, compressed(2)); }), 0);
  const Bytes read = records_of(path);
  EXPECT_EQ(LasReader::open(path)->header().generating_software, kLasUnfinished);
  EXPECT_GE(read.size(), 50'000u * 58);
  EXPECT_EQ(read.size() % (50'000 * 58), 0u);
}

TEST(LasReader, SaysWhichLazItDoesNotRead) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.laz";
  write_cloud(path, sample_cloud(10), compressed());
  const Bytes whole = test::bytes_of(path);
  const auto open_with = [&](std::size_t at, std::uint8_t byte) {
    Bytes other = whole;
    other[at] = std::byte{byte};
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(other.data()), static_cast<std::streamsize>(other.size()));
    auto reader = LasReader::open(path);
    return reader ? std::string() : reader.error().message;
  };
  EXPECT_NE(open_with(104, 0x84).find("of format 4: 0 to 3 and 6 to 8 are read"), std::string::npos);
  EXPECT_NE(open_with(104, 0x83).find("format 3 with the compression 3 of LASzip: 2 is read"), std::string::npos);
  EXPECT_NE(open_with(105, 60).find("does not describe the points"), std::string::npos);
}

}  // namespace
}  // namespace hueline::storage
