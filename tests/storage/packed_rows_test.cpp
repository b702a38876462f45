#include "storage/packed_rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "storage_proto/hueline/RawPacket.pb.h"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/each_instruction_set.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

/// Returns a payload with an image whose samples wander by about `noise` from row to row.
Bytes image_of(const PixelRows& rows, std::size_t behind, unsigned noise, unsigned shift, std::uint32_t seed) {
  std::mt19937 random(seed);
  Bytes out(rows.offset + std::size_t{rows.stride} * rows.rows + behind);
  for (std::byte& b : out) b = static_cast<std::byte>(random());
  for (std::size_t row = 0; row < rows.rows; ++row)
    for (std::size_t i = 0; i < rows.stride / rows.sample_bytes; ++i) {
      const auto value = static_cast<std::uint16_t>((row / 3 + i / 2 + random() % (noise + 1)) << shift);
      std::memcpy(out.data() + rows.offset + row * rows.stride + i * rows.sample_bytes, &value, rows.sample_bytes);
    }
  return out;
}

Bytes packed_of(ByteView payload, const PixelRows& rows) {
  Bytes out(packed_rows_bound(payload.size(), rows));
  out.resize(pack_rows(payload, rows, out));
  return out;
}

/// Unpacks bit by bit, as docs/formats.md describes it.
Bytes unpacked_slowly(ByteView in) {
  const auto at = [&](std::size_t i) { return std::to_integer<std::uint32_t>(in[i]); };
  const auto number = [&](std::size_t i) { return at(i) | at(i + 1) << 8 | at(i + 2) << 16 | at(i + 3) << 24; };
  const std::size_t sample = at(1), colour_rows = at(2), shift = at(3), offset = number(4), stride = number(8),
                    rows = number(12), size = number(16), count = stride / sample, blocks = (count + 31) / 32;
  Bytes out(size);
  std::size_t next = 24;
  for (std::size_t i = 0; i < offset; ++i) out[i] = in[next++];
  for (std::size_t i = offset + stride * rows; i < size; ++i) out[i] = in[next++];
  const auto sample_at = [&](std::size_t row, std::size_t i) {
    std::uint32_t value = 0;
    std::memcpy(&value, out.data() + offset + row * stride + i * sample, sample);
    return value;
  };
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t widths = next;
    next += sample == 1 ? (blocks + 1) / 2 : blocks;
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::uint32_t width = sample == 1 ? at(widths + block / 2) >> 4 * (block % 2) & 15 : at(widths + block);
      for (std::size_t i = 0; i < 32; ++i) {
        std::uint32_t folded = 0;
        for (std::uint32_t k = 0; k < width; ++k) folded |= (number(next + 4 * k) >> i & 1) << k;
        const std::size_t column = 32 * block + i;
        if (column >= count) continue;
        const std::uint32_t difference = folded % 2 == 0 ? folded / 2 : ~(folded / 2);
        const std::uint32_t above = row < colour_rows ? 0 : sample_at(row - colour_rows, column) >> shift;
        const std::uint32_t value = (above + difference) << shift;
        std::memcpy(out.data() + offset + row * stride + column * sample, &value, sample);
      }
      next += std::size_t{4} * width;
    }
  }
  EXPECT_EQ(next, in.size());
  return out;
}

const std::vector<PixelRows> kShapes = {{64, 1920, 40, 1, 2}, {64, 1000, 31, 1, 1}, {0, 97, 12, 1, 2},
                                        {3, 640, 25, 2, 2},   {64, 330, 17, 2, 1},  {7, 32, 5, 1, 1},
                                        {64, 64, 1, 1, 2},    {1, 2046, 9, 2, 1}};

TEST(PackedRows, GiveBackEveryByteWithEachInstructionSet) {
  for (const PixelRows& rows : kShapes)
    for (const unsigned noise : {0u, 1u, 5u, 30u})
      for (const unsigned shift : {0u, 3u}) {
        const Bytes payload = image_of(rows, 11, noise, shift, noise + rows.stride);
        std::optional<Bytes> first;
        test::with_each_instruction_set([&] {
          const Bytes packed = packed_of(payload, rows);
          if (!first) first = packed;
          EXPECT_EQ(packed, *first) << "the bytes depend on the processor";
          if (packed.empty()) return;
          EXPECT_LT(packed.size(), payload.size());
          const auto back = unpack_rows(packed);
          ASSERT_TRUE(back.ok()) << back.error().message;
          EXPECT_EQ(back->rows, rows);
          EXPECT_TRUE(std::ranges::equal(back->payload.bytes(), payload));
        });
        if (!first->empty()) {
          EXPECT_EQ(unpacked_slowly(*first), payload);
        }
      }
}

/// Two rows below, a sample is at most one brighter, and differs by the noise.
TEST(PackedRows, TakeAsManyBitsAsTheNoiseHas) {
  const PixelRows rows{64, 2048, 200, 1, 2};
  const auto share = [&](unsigned noise) {
    const Bytes payload = image_of(rows, 0, noise, 0, 1);
    return static_cast<double>(packed_of(payload, rows).size()) / static_cast<double>(payload.size());
  };
  for (const unsigned noise : {0u, 3u, 12u}) {
    const double most = static_cast<double>(std::bit_width(2 * (noise + 1))) / 8;  // and half a byte for 32 samples
    EXPECT_LT(share(noise), most + 0.02) << noise;
    EXPECT_GT(share(noise), most - 0.1) << noise;
  }
  EXPECT_EQ(share(255), 0);
  // Twelve bits in two bytes, at the upper end of them as some cameras have them, cost no more than at the lower end.
  const PixelRows wide{64, 4096, 100, 2, 2};
  const auto low = packed_of(image_of(wide, 0, 30, 0, 2), wide), high = packed_of(image_of(wide, 0, 30, 4, 2), wide);
  EXPECT_EQ(low.size(), high.size());
  EXPECT_LT(low.size(), std::size_t{4096} * 100 / 2);
}

TEST(PackedRows, RefuseRowsThatAreNoneAndBytesThatAreDamaged) {
  const PixelRows rows{64, 640, 20, 1, 2};
  const Bytes payload = image_of(rows, 5, 3, 0, 7), packed = packed_of(payload, rows);
  ASSERT_FALSE(packed.empty());
  for (PixelRows wrong : {PixelRows{64, 640, 21, 1, 2}, PixelRows{64, 640, 0, 1, 2}, PixelRows{64, 0, 20, 1, 2},
                          PixelRows{64, 641, 10, 2, 2}, PixelRows{64, 640, 20, 3, 2}, PixelRows{64, 640, 20, 1, 3},
                          PixelRows{0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 1, 1}}) {
    EXPECT_EQ(packed_rows_bound(payload.size(), wrong), 0u);
    Bytes out(1 << 20);
    EXPECT_EQ(pack_rows(payload, wrong, out), 0u);
  }
  Bytes small(packed_rows_bound(payload.size(), rows) - 1);
  EXPECT_EQ(pack_rows(payload, rows, small), 0u);
  for (std::size_t size = 0; size < packed.size(); size += size < 40 ? 1 : 37) {
    const Bytes cut(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(unpack_rows(cut).error().code, ErrorCode::Malformed) << size;
  }
  Bytes longer = packed;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(unpack_rows(longer).ok());
  for (std::size_t at = 0; at < 24; ++at)
    for (const unsigned value : {1u, 3u, 9u, 16u, 255u}) {
      Bytes changed = packed;
      if (changed[at] == std::byte(value)) continue;
      changed[at] = std::byte(value);
      const auto back = unpack_rows(changed);  // a head that is possible by chance gives another image
      if (back.ok()) {
        EXPECT_NE(back->rows, PixelRows{}) << at;
      }
    }
}

/// What a recording holds, and that its readers and copies give the bytes that came.
TEST(PackedRows, AreStoredInARecordingOfFormat2) {
  const test::TemporaryFolder folder;
  JournalHeader header = test::sample_header();
  std::vector<Packet> packets = test::sample_packets(60);
  const PixelRows rows{64, 1920, 100, 1, 2};
  std::size_t images = 0;
  for (std::size_t i = 0; i < packets.size(); ++i)
    if (Packet& packet = packets[i]; packet.sensor == 2 && packet.kind == PacketKind::Wire) {
      packet.rows = rows;
      if (i % 2 == 0) packet.bytes = Buffer::copy_of(image_of(rows, 0, 4, 0, static_cast<std::uint32_t>(i)));
      images += i % 2 == 0;
    }
  ASSERT_GT(images, 3u);
  std::vector<std::uintmax_t> sizes;
  for (const bool packs : {false, true}) {
    header.has_packed_images = packs;
    const auto path = folder / (packs ? "packed.mcap" : "plain.mcap");
    auto writer = JournalWriter::create(path, header);
    ASSERT_TRUE(writer) << writer.error().message;
    for (const Packet& p : packets) ASSERT_TRUE(writer->append(p, test::time_of(p)));
    std::uint64_t payload = 0;
    for (const auto& counts : writer->counts()) payload += counts.payload_bytes;
    ASSERT_TRUE(writer->close());
    std::uint64_t came = 0;
    for (const Packet& p : packets) came += p.bytes.size();
    EXPECT_EQ(payload, came) << "the ledger counts what came";
    sizes.push_back(std::filesystem::file_size(path));

    auto reader = JournalReader::open(path);
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_EQ((*reader)->header(), header);
    for (const Packet& p : packets) {
      const auto packet = (*reader)->next({});
      ASSERT_TRUE(packet) << packet.error().message;
      EXPECT_TRUE(test::same(*packet, p));
      const bool is_packed = packs && p.bytes.size() == rows.offset + std::size_t{rows.stride} * rows.rows;
      EXPECT_EQ(packet->rows, is_packed ? rows : PixelRows{}) << "so that a copy packs it again";
    }
  }
  EXPECT_LT(sizes[1], sizes[0] - images * std::size_t{1920} * 100 / 3);

  // Programs that do not know of it find no payload, and the field by its name in the schema.
  std::ifstream in(folder / "packed.mcap", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(bytes.find("packed_rows"), std::string::npos);
}

}  // namespace
}  // namespace hueline::storage
