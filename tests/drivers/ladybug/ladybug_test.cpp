#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/calendar.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/ladybug/ladybug_decoder.hpp"
#include "drivers/ladybug/ladybug_image.hpp"
#include "drivers/ladybug/pgr_source.hpp"
#include "tests/drivers/gige/jpeg_planes_packets.hpp"
#include "tests/drivers/ladybug/pgr_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::drivers {
namespace {

using test::lens_mosaic;
using test::PgrStream;
using test::write_pgr;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint32_t kLensWidth = 48, kLensHeight = 32;

/// The bytes of one image as the simulator's encoder makes them.
std::vector<std::byte> image_of(std::uint32_t sequence, std::int64_t unix_us = 1'700'000'000'250'000) {
  const auto mosaic = lens_mosaic(3, kLensWidth, kLensHeight);
  sim::JpegPlanesImage image;
  image.mosaic = mosaic;
  image.width = 3 * kLensWidth;
  image.height = 2 * kLensHeight;
  image.sequence = sequence;
  image.unix_us = unix_us;
  image.reports.assign(6, {1'500'000, 0.0f});
  const auto bytes = sim::encode_jpeg_planes(image);
  EXPECT_TRUE(bytes.ok());
  return *bytes;
}
void set_be32(std::vector<std::byte>& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(value >> (24 - 8 * i));
}
LadybugDecoder::Config config_of(LadybugDecoder::Stamp stamp = LadybugDecoder::Stamp::None) {
  LadybugDecoder::Config config;
  config.width = 3 * kLensWidth;
  config.height = 2 * kLensHeight;
  config.planes.lens_columns = 3;
  config.stamp = stamp;
  return config;
}
Packet packet_of(const std::vector<std::byte>& bytes) {
  return {.sensor = 3, .sequence = 77, .received = host_time_ns(9), .bytes = Buffer::copy_of(bytes)};
}
std::vector<std::string> told(LadybugDecoder& decoder, const Packet& packet) {
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  std::vector<std::string> words;
  for (const auto& m : out) {
    if (const auto* f = std::get_if<Fault>(&m))
      words.push_back(std::string(name(f->kind)) + " " + std::to_string(f->count));
    if (const auto* i = std::get_if<Image>(&m)) words.push_back("image " + std::to_string(i->frame_id));
  }
  return words;
}

TEST(LadybugImage, EachFieldIsWhereItIsKnownToBe) {
  std::vector<std::byte> bytes(0x400 + 20);
  for (std::size_t at = 0; at + 4 <= 0x340; at += 4) set_be32(bytes, at, static_cast<std::uint32_t>(0x1000 + at));
  set_be32(bytes, 0x00, 127u << 25 | 7999u << 12 | 3071u);
  set_be32(bytes, 0x08, 0x414);
  set_be32(bytes, 0x10, 0xCAFEBABE);
  set_be32(bytes, 0x14, 2);
  set_be32(bytes, 0x18, 1'700'000'000);
  set_be32(bytes, 0x1C, 999'999);
  set_be32(bytes, 0x338, 0x404);
  set_be32(bytes, 0x33C, 10);
  const auto image = read_ladybug_image(bytes);
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_EQ(image->size, 0x414u);
  EXPECT_EQ(image->unix_time, nanoseconds(1'700'000'000'999'999'000));
  EXPECT_EQ(image->sequence, 0x1020u);
  const auto planes = read_jpeg_planes(bytes);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  EXPECT_THAT(planes->gains, ElementsAre(0x1028, 0x102C, 0x1030, 0x1034, 0x1038, 0x103C));
  EXPECT_THAT(planes->shutters, ElementsAre(0x1058, 0x105C, 0x1060, 0x1064, 0x1068, 0x106C));
  EXPECT_EQ(image->white_balance, 0x1040u);
  EXPECT_EQ(image->bayer_gain, 0x1044u);
  EXPECT_EQ(image->bayer_map, 0x1048u);
  EXPECT_EQ(image->brightness, 0x104Cu);
  EXPECT_EQ(image->gamma, 0x1050u);
  EXPECT_EQ(image->serial, 0x1054u);
  EXPECT_EQ(image->nmea.data(), bytes.data() + 0x404);
  EXPECT_EQ(image->nmea.size(), 10u);
  // 127 s, 7999 cycles, and 3071 parts of 3072 without the 4 lowest bits: 3056 parts.
  EXPECT_EQ(image->cycle_time, std::chrono::seconds(127) + nanoseconds((7999 * 3072LL + 3056) * 125'000 / 3072));
}

TEST(LadybugImage, BrokenOnesAreRefused) {
  auto bytes = image_of(1);
  const auto code = [&](std::size_t at, std::uint32_t value) {
    auto copy = bytes;
    set_be32(copy, at, value);
    const auto read = read_ladybug_image(copy);
    return read.ok() ? std::string("ok") : std::string(name(read.error().code));
  };
  EXPECT_EQ(code(0x14, 2), "ok");
  EXPECT_EQ(code(0x10, 1), "Malformed");
  EXPECT_EQ(code(0x14, 3), "Unsupported");
  EXPECT_EQ(code(0x1C, 1'000'000), "Malformed");
  EXPECT_EQ(code(0x33C, 0xFFFFFFFF), "Malformed");
  bytes.resize(0x3FF);
  EXPECT_EQ(code(0x14, 2), "Truncated");
}

TEST(LadybugDecoder, GivesTheMosaicOfItsPlanes) {
  LadybugDecoder decoder(config_of());
  std::vector<Measurement> out;
  const auto bytes = image_of(7);
  decoder.decode(packet_of(bytes), out);
  ASSERT_EQ(out.size(), 1u);
  const auto& got = std::get<Image>(out[0]);
  EXPECT_EQ(got.frame_id, 7u);
  EXPECT_EQ(got.packet_sequence, 77u);
  EXPECT_EQ(got.format, PixelFormat::BayerRG8);
  EXPECT_TRUE(got.is_complete);
  ImageDecoder other(test::planes_config(3, kLensWidth, kLensHeight));
  std::vector<Measurement> others;
  other.decode(test::planes_packet(bytes), others);
  const auto& same = std::get<Image>(others.at(0));
  ASSERT_EQ(got.pixels().size(), same.pixels().size());
  EXPECT_TRUE(std::ranges::equal(got.pixels(), same.pixels()));
  EXPECT_EQ(decoder.counts().decoded_bytes, bytes.size());
}

TEST(LadybugDecoder, TellsTheShutterAndTheGainOfEachLens) {
  auto bytes = image_of(7);
  for (std::size_t lens = 0; lens < 6; ++lens) {
    set_be32(bytes, 0x28 + 4 * lens, static_cast<std::uint32_t>(10 * lens));
    set_be32(bytes, 0x58 + 4 * lens, static_cast<std::uint32_t>(100 + lens));
  }
  set_be32(bytes, 0x58 + 4 * 3, 0x82000000 | 700);  // a register of IIDC, with its switches
  set_be32(bytes, 0x58 + 4 * 4, 0x7fffffff);        // no shutter
  const auto reported = [&](nanoseconds shutter_step, double gain_step_dB) {
    auto config = config_of();
    config.planes.shutter_step = shutter_step;
    config.planes.gain_step_dB = gain_step_dB;
    EXPECT_EQ(config.validate(), "");
    LadybugDecoder decoder(config);
    std::vector<Measurement> out;
    decoder.decode(packet_of(bytes), out);
    return std::get<Image>(out.at(0)).reported;
  };
  EXPECT_THAT(reported(nanoseconds(0), 0), testing::IsEmpty()) << "the steps depend on the model";
  const auto all = reported(nanoseconds(20'000), 0.1);
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[0].duration, nanoseconds(2'000'000));
  EXPECT_EQ(all[5].duration, nanoseconds(2'100'000));
  EXPECT_EQ(all[3].duration, nanoseconds(14'000'000));
  EXPECT_EQ(all[4].duration, nanoseconds(0));
  EXPECT_FLOAT_EQ(all[0].gain, 1.0f);
  EXPECT_NEAR(all[2].gain, 1.2589f, 1e-4f) << "2 dB";
  EXPECT_EQ(all[1].region.width, kLensWidth);
  EXPECT_EQ(all[1].region.x + all[1].region.y, config_of().planes.lens_columns == 1 ? kLensHeight : kLensWidth);
  const auto shutters = reported(nanoseconds(20'000), 0);
  EXPECT_EQ(shutters.at(0).gain, 0);
}

TEST(LadybugDecoder, TheStampIsTheOneThatTheRigNames) {
  auto bytes = image_of(1);
  set_be32(bytes, 0, 5u << 25);
  const auto decoded = [&](LadybugDecoder::Stamp stamp) {
    LadybugDecoder decoder(config_of(stamp));
    std::vector<Measurement> out;
    decoder.decode(packet_of(bytes), out);
    return out;
  };
  const auto time_in = [](const Measurement& m) { return std::get<Image>(m).time.time_since_epoch(); };
  EXPECT_EQ(time_in(decoded(LadybugDecoder::Stamp::None).at(0)), nanoseconds(0));
  EXPECT_EQ(time_in(decoded(LadybugDecoder::Stamp::Cycle).at(0)), std::chrono::seconds(5));
  EXPECT_EQ(time_in(decoded(LadybugDecoder::Stamp::Unix).at(0)), nanoseconds(1'700'000'000'250'000'000));
  const auto utc = decoded(LadybugDecoder::Stamp::Utc);
  ASSERT_EQ(utc.size(), 2u);
  EXPECT_EQ(time_in(utc[1]), nanoseconds(1'700'000'000'250'000'000));
  // GPS time was 18 s ahead of UTC in 2023.
  EXPECT_EQ(count_ns(std::get<TimedArrival>(utc[0]).time), 1'700'000'000'250'000'000 - 315'964'782'000'000'000);
}

TEST(LadybugDecoder, GapsOfTheSequenceAreLostImages) {
  LadybugDecoder decoder(config_of());
  const auto tell = [&](std::uint32_t sequence) { return told(decoder, packet_of(image_of(sequence))); };
  EXPECT_THAT(tell(10), ElementsAre("image 10"));
  EXPECT_THAT(tell(13), ElementsAre("Lost 2", "image 13"));
  EXPECT_THAT(tell(13), ElementsAre("Spurious 1"));
  EXPECT_THAT(tell(0), ElementsAre("Spurious 1", "image 0"));
  decoder.reset();
  EXPECT_THAT(tell(100), ElementsAre("image 100"));
}

TEST(LadybugDecoder, OtherHeadsAndBrokenPlanesAreTold) {
  auto config = config_of();
  config.serial = 99;
  LadybugDecoder decoder(config);
  EXPECT_THAT(told(decoder, packet_of(image_of(1))), ElementsAre("WrongDevice 1"));
  auto bytes = image_of(1);
  set_be32(bytes, 0x54, 99);
  set_be32(bytes, 0x340 + 8 * 4 * 2, 5);  // lens 2, its first plane: inside the head
  EXPECT_THAT(told(decoder, packet_of(bytes)), ElementsAre("Malformed 1", "image 1"));
  EXPECT_THAT(told(decoder, packet_of({bytes.begin(), bytes.begin() + 100})), ElementsAre("Malformed 1"));
  const auto& counts = decoder.counts();
  EXPECT_EQ(counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes, 2 * bytes.size() + 100);
}

class PgrFiles : public testing::Test {
 protected:
  struct Read {
    std::vector<Packet> packets;
    std::vector<std::string> faults;
    std::string end;
  };
  Read read(const std::filesystem::path& path) {
    PgrSource source({path});
    Read all;
    if (const Status opened = source.open(); !opened) {
      all.end = std::string(name(opened.error().code)) + ": " + opened.error().message;
      return all;
    }
    for (int calls = 0; calls < 1000; ++calls) {
      auto packet = source.next({});
      if (!packet) {
        all.end += name(packet.error().code);
        if (packet.error().code == ErrorCode::EndOfData || packet.error().code == ErrorCode::Io) break;
        all.end += " ";
      } else if (packet->kind == PacketKind::Fault) {
        const auto fault = decode_fault(0, packet->received, packet->bytes.bytes());
        all.faults.push_back(std::string(name(fault->kind)) + " " + std::to_string(fault->count));
      } else {
        all.packets.push_back(std::move(*packet));
      }
    }
    return all;
  }
  std::filesystem::path write(const std::string& name, const std::vector<std::byte>& bytes) {
    test::write_file(folder_ / name, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    return folder_ / name;
  }
  static PgrStream stream_of(std::uint32_t first, std::uint32_t count) {
    PgrStream stream;
    for (std::uint32_t i = 0; i < count; ++i) stream.images.push_back(image_of(first + i));
    return stream;
  }
  static bool same(const Packet& packet, const std::vector<std::byte>& bytes) {
    return std::ranges::equal(packet.bytes.bytes(), bytes);
  }
  const test::TemporaryFolder folder_;
};

TEST_F(PgrFiles, EveryImageIsAPacketOfItsBytes) {
  PgrStream stream = stream_of(1, 3);
  stream.gps_summary = "GPSSUMMARY_00001 and so on";
  for (const std::size_t padding : {0u, 512u, 5u}) {
    stream.padding = padding;
    const auto bytes = write_pgr(stream);
    const Read got = read(write("a.pgr", bytes));
    EXPECT_EQ(got.end, "EndOfData");
    EXPECT_THAT(got.faults, testing::IsEmpty()) << padding;
    ASSERT_EQ(got.packets.size(), 5u);
    EXPECT_TRUE(same(got.packets[0], {bytes.begin(), bytes.begin() + 16 + 3056 + 17}));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(same(got.packets[1 + i], stream.images[i])) << i;
    EXPECT_EQ(got.packets[4].bytes.size(), stream.gps_summary.size());
    LadybugDecoder decoder(config_of());
    EXPECT_THAT(told(decoder, got.packets[0]), testing::IsEmpty());
    EXPECT_THAT(told(decoder, got.packets[1]), ElementsAre("image 1"));
    EXPECT_THAT(told(decoder, got.packets[4]), testing::IsEmpty());
  }
}

TEST_F(PgrFiles, PartsOfARecordingFollowEachOther) {
  write("drive-000009.pgr", write_pgr(stream_of(1, 2)));
  write("drive-000010.pgr", write_pgr(stream_of(3, 1)));
  write("drive-000012.pgr", write_pgr(stream_of(9, 1)));
  const Read got = read(folder_ / "drive-000009.pgr");
  EXPECT_EQ(got.end, "EndOfData");
  LadybugDecoder decoder(config_of());
  std::vector<std::string> all;
  for (const Packet& packet : got.packets)
    for (auto& word : told(decoder, packet)) all.push_back(word);
  EXPECT_THAT(all, ElementsAre("image 1", "image 2", "image 3"));
  EXPECT_EQ(next_pgr_file("a/b-000999.pgr"), "a/b-001000.pgr");
  EXPECT_EQ(next_pgr_file("a/b.pgr"), "");
  EXPECT_EQ(next_pgr_file("a/b-00099x.pgr"), "");
}

TEST_F(PgrFiles, DamageIsSkippedAndTold) {
  const PgrStream stream = stream_of(1, 3);
  auto bytes = write_pgr(stream);
  const std::size_t second = 16 + 3056 + 17 + stream.images[0].size();
  for (std::size_t i = 0; i < 0x20; ++i) bytes[second + i] = std::byte{0x77};
  const Read got = read(write("a.pgr", bytes));
  EXPECT_EQ(got.end, "EndOfData");
  EXPECT_THAT(got.faults, ElementsAre("Malformed " + std::to_string(stream.images[1].size()), "Lost 1"));
  ASSERT_EQ(got.packets.size(), 3u);
  EXPECT_TRUE(same(got.packets[2], stream.images[2]));
}

TEST_F(PgrFiles, ACutOrWrongFileIsTold) {
  PgrStream stream = stream_of(1, 2);
  stream.said_images = 5;
  auto bytes = write_pgr(stream);
  Read got = read(write("a.pgr", bytes));
  EXPECT_THAT(got.faults, ElementsAre("Lost 3"));
  bytes.resize(bytes.size() - 10);
  got = read(write("a.pgr", bytes));
  EXPECT_EQ(got.end, "Truncated EndOfData");
  EXPECT_EQ(got.packets.size(), 2u);
  bytes.resize(3000);
  EXPECT_THAT(read(write("a.pgr", bytes)).end, HasSubstr("Malformed"));
  bytes.resize(16 + 3056);
  EXPECT_THAT(read(write("a.pgr", bytes)).end, HasSubstr("its first image is said to begin"));
  bytes[0] = std::byte{'X'};
  EXPECT_THAT(read(write("a.pgr", bytes)).end, HasSubstr("does not begin with PGRLADYBUGSTREAM"));
  EXPECT_THAT(read(folder_ / "none.pgr").end, HasSubstr("Io"));
}

}  // namespace
}  // namespace hueline::drivers
