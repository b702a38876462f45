// Recordings of real receivers. The numbers of messages, the CRC states and the values below come from an independent
// reader (Python struct and zlib), not from the decoder.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/novatel/decoder.hpp"
#include "drivers/transport/file_source.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::all_of;

struct Decoded {
  std::vector<Measurement> measurements;
  DecodeCounts counts;
  std::uint64_t bytes = 0;
};

Decoded decode_file(const std::filesystem::path& path, std::size_t chunk_bytes = 4096) {
  FileSource::Config config;
  config.path = path;
  config.chunk_bytes = chunk_bytes;
  FileSource source(config);
  EXPECT_TRUE(source.open().ok());
  NovatelDecoder decoder({});
  Decoded out;
  for (;;) {
    Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      EXPECT_EQ(packet.error().code, ErrorCode::EndOfData) << packet.error().message;
      break;
    }
    out.bytes += packet->bytes.size();
    decoder.decode(*packet, out.measurements);
  }
  decoder.flush(out.measurements);
  EXPECT_EQ(decoder.held_bytes(), 0u);
  out.counts = decoder.counts();
  EXPECT_EQ(test::total(out.counts), std::filesystem::file_size(path));
  EXPECT_EQ(out.bytes, std::filesystem::file_size(path));
  std::printf("%s: %llu bytes: decoded %llu, ignored %llu, malformed %llu (%llu messages)\n", path.filename().c_str(),
              static_cast<unsigned long long>(out.bytes), static_cast<unsigned long long>(out.counts.decoded_bytes),
              static_cast<unsigned long long>(out.counts.ignored_bytes),
              static_cast<unsigned long long>(out.counts.malformed_bytes),
              static_cast<unsigned long long>(out.counts.malformed_messages));
  for (const auto& [name, number] : out.counts.messages)
    std::printf("  %-16s %llu\n", name.c_str(), static_cast<unsigned long long>(number));
  for (const Fault& fault : all_of<Fault>(out.measurements))
    std::printf("  %s: %s\n", name(fault.kind), fault.detail.c_str());
  return out;
}

using Names = std::map<std::string, std::uint64_t>;

TEST(NovatelCaptures, Align) {
  HUELINE_REQUIRE_DATA("novatel/align.gps");
  const Decoded d = decode_file(data_file);
  EXPECT_EQ(d.counts.messages, (Names{{"HEADING2", 12}}));
  EXPECT_EQ(d.counts.ignored_bytes, 960u);
  EXPECT_EQ(all_of<TimedArrival>(d.measurements).size(), 12u);
}

TEST(NovatelCaptures, BestposBeginsWithTheAnswersToItsCommands) {
  HUELINE_REQUIRE_DATA("novatel/bestpos.gps");
  const Decoded d = decode_file(data_file);
  Names messages = d.counts.messages;
  EXPECT_GT(messages["text"], 0u);
  messages.erase("text");
  EXPECT_EQ(messages,
            (Names{{"INSPVAS", 10}, {"BESTPOS", 5}, {"BESTVEL", 5}, {"PSRDOP2", 2}, {"INSPVAX", 2}, {"BESTUTM", 2}}));
  EXPECT_EQ(d.counts.malformed_bytes, 0u);
  // 104 bytes of text, and the messages that become no measurement.
  EXPECT_EQ(d.counts.ignored_bytes, 104u + 5 * (28 + 44 + 4) + 2 * (28 + 36 + 4) + 2 * (28 + 80 + 4));

  const auto fixes = all_of<GnssFix>(d.measurements);
  ASSERT_EQ(fixes.size(), 5u);
  EXPECT_EQ(fixes[0].type, FixType::Single);
  EXPECT_EQ(fixes[0].time, from_gps_week(2134, std::chrono::seconds(506710)));
  EXPECT_NEAR(fixes[0].position.latitude, 51.15043782363468 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(fixes[0].position.longitude, -114.03068530001241 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(fixes[0].position.ellipsoidal_height, 1094.0990624893457 - 17.0, 1e-9);
  EXPECT_NEAR(fixes[0].sigma_enu[0], 1.6865170001983643, 1e-7);  // east: the wire's second
  EXPECT_NEAR(fixes[0].sigma_enu[1], 1.9175126552581787, 1e-7);
  EXPECT_EQ(fixes[0].satellites, 16);
}

TEST(NovatelCaptures, InspvaxAndInspvasAgreeOnTheSameInstant) {
  HUELINE_REQUIRE_DATA("novatel/bestpos.gps");
  // The receiver gives the same place in two messages, one with the height above the geoid, one above the ellipsoid.
  int pairs = 0;
  const Decoded d = decode_file(data_file);
  const auto solutions = all_of<InsSolution>(d.measurements);
  for (const InsSolution& x : solutions) {
    if (!x.sigma) continue;
    for (const InsSolution& s : solutions) {
      if (s.sigma || s.time != x.time) continue;
      ++pairs;
      EXPECT_NEAR(x.position.ellipsoidal_height, s.position.ellipsoidal_height, 1e-6);
      EXPECT_NEAR(x.position.latitude, s.position.latitude, 1e-14);
      EXPECT_NEAR(x.attitude.heading, s.attitude.heading, 1e-12);
      EXPECT_NEAR((x.velocity_enu - s.velocity_enu).norm(), 0, 1e-12);
      EXPECT_EQ(x.status, s.status);
    }
  }
  EXPECT_EQ(pairs, 2);
}

TEST(NovatelCaptures, Ins1) {
  HUELINE_REQUIRE_DATA("novatel/ins1.gps");
  const Decoded d = decode_file(data_file);
  EXPECT_EQ(d.counts.messages, (Names{{"INSCONFIG", 2}, {"INSPVAS", 243}, {"INSSTDEV", 29}, {"CORRIMUS", 10}}));
  EXPECT_EQ(d.counts.malformed_bytes, 0u);
  const auto solutions = all_of<InsSolution>(d.measurements);
  ASSERT_EQ(solutions.size(), 243u);
  const InsSolution& first = solutions[0];
  EXPECT_EQ(first.time, from_gps_week(2101, std::chrono::milliseconds(148472900)));
  EXPECT_NEAR(first.velocity_enu.x(), 0.0005040844415039028, 1e-15);  // east, the wire's second
  EXPECT_NEAR(first.velocity_enu.y(), 0.0006731112905959353, 1e-15);
  EXPECT_NEAR(first.attitude.roll, -0.8719019553105114 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(first.attitude.pitch, -0.6501802912853099 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(first.attitude.heading, 338.1282791284771 * kRadPerDeg, 1e-14);
  EXPECT_EQ(first.status, 7u);  // INS_ALIGNMENT_COMPLETE: not yet within specification
  EXPECT_FALSE(first.is_good);
  const auto sigmas = all_of<InsUncertainty>(d.measurements);
  ASSERT_EQ(sigmas.size(), 29u);
  EXPECT_NEAR(sigmas[0].sigma[0], 2.295344114303589, 1e-7);
  EXPECT_NEAR(sigmas[0].sigma[1], 2.299515724182129, 1e-7);
  EXPECT_NEAR(sigmas[0].sigma[8], 14.40955924987793 * kRadPerDeg, 1e-7);
  // The car is parked: the accelerometers measure gravity (Calgary, 1080 m: 9.808 m/s^2), upwards, and it turns only
  // with the earth.
  const auto samples = all_of<ImuSample>(d.measurements);
  ASSERT_EQ(samples.size(), 10u);
  for (const ImuSample& sample : samples) {
    EXPECT_NEAR(sample.specific_force_body.norm(), 9.808, 0.02);
    EXPECT_GT(sample.specific_force_body.z(), 9.7);
    EXPECT_LT(sample.angular_rate_body.norm(), 0.01);
  }
}

TEST(NovatelCaptures, Ins2) {
  HUELINE_REQUIRE_DATA("novatel/ins2.gps");
  const Decoded d = decode_file(data_file);
  EXPECT_EQ(d.counts.messages, (Names{{"INSCONFIG", 1}, {"IMURATECORRIMUS", 766}, {"INSPVAS", 62}, {"INSPVAX", 6}}));
  EXPECT_EQ(d.counts.malformed_bytes, 0u);
  const auto samples = all_of<ImuSample>(d.measurements);
  EXPECT_GT(samples.size(), 740u);  // all but those before the first attitude
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : samples) mean += sample.specific_force_body / static_cast<double>(samples.size());
  EXPECT_NEAR(mean.norm(), 9.808, 0.005);
}

TEST(NovatelCaptures, Rxstatus) {
  HUELINE_REQUIRE_DATA("novatel/rxstatus.gps");
  const Decoded d = decode_file(data_file);
  EXPECT_EQ(d.counts.messages, (Names{{"RXSTATUS", 3}}));
  EXPECT_EQ(d.counts.ignored_bytes, 360u);
}

TEST(NovatelCaptures, Time) {
  HUELINE_REQUIRE_DATA("novatel/time.gps");
  const Decoded d = decode_file(data_file);
  EXPECT_EQ(d.counts.messages, (Names{{"TIME", 6}}));
  const auto labels = all_of<TimeLabel>(d.measurements);
  ASSERT_EQ(labels.size(), 6u);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    EXPECT_EQ(labels[i].second, from_gps_week(2070, std::chrono::seconds(241084 + static_cast<int>(i))));
    EXPECT_TRUE(labels[i].is_valid);
    ASSERT_TRUE(labels[i].utc_offset);
    EXPECT_EQ(*labels[i].utc_offset, std::chrono::seconds(18));
  }
  EXPECT_EQ(iso_utc(labels[0].second), "2019-09-10T18:57:46.000Z");  // the message's own UTC fields
}

TEST(NovatelCaptures, SyncErrorIsOneHeaderThatClaimsMoreThanTheFile) {
  HUELINE_REQUIRE_DATA("novatel/binary_sync_error.BIN");
  // AA 44 12 FF ... FF FF, then zeros: a header of 255 and a body of 65535 bytes, two more than the file has. There is
  // no message in it.
  const Decoded d = decode_file(data_file);
  EXPECT_TRUE(d.counts.messages.empty());
  EXPECT_EQ(d.counts.malformed_bytes, 65792u);
  EXPECT_EQ(d.counts.malformed_messages, 1u);
  std::uint64_t reported = 0;
  for (const Fault& fault : all_of<Fault>(d.measurements)) {
    EXPECT_EQ(fault.kind, FaultKind::Malformed);
    reported += fault.count;
  }
  EXPECT_EQ(reported, 65792u);
}

TEST(NovatelCaptures, WhereTheStreamIsCutChangesNothing) {
  for (const char* file : {"align", "bestpos", "rxstatus", "time"}) {
    HUELINE_REQUIRE_DATA(std::string("novatel/") + file + ".gps");
    const test::Bytes bytes = test::read_all(data_file);
    const auto decode_cut = [&](std::size_t cut) {
      NovatelDecoder decoder({});
      std::vector<Measurement> out;
      const std::span<const std::byte> all(bytes);
      decoder.decode(test::packet_of(all.first(cut)), out);
      decoder.decode(test::packet_of(all.subspan(cut)), out);
      decoder.flush(out);
      std::vector<std::string> lines;
      for (const Measurement& m : out) lines.push_back(test::described(m));
      for (const auto& [name, number] : decoder.counts().messages) lines.push_back(name + std::to_string(number));
      return lines;
    };
    const auto whole = decode_cut(0);
    for (std::size_t cut = 1; cut <= bytes.size(); ++cut)
      ASSERT_EQ(decode_cut(cut), whole) << file << " cut at " << cut;
  }
}

TEST(NovatelCaptures, ChunkSizeChangesNothing) {
  HUELINE_REQUIRE_DATA("novatel/ins2.gps");
  const auto lines = [&](std::size_t chunk) {
    std::vector<std::string> out;
    for (const Measurement& m : decode_file(data_file, chunk).measurements) {
      const std::string line = test::described(m);
      if (!line.starts_with("arrival")) out.push_back(line);  // these carry the pieces' counted arrival
    }
    return out;
  };
  const auto whole = lines(1 << 20);
  for (const std::size_t chunk : {std::size_t{1}, std::size_t{3}, std::size_t{77}, std::size_t{1000}})
    EXPECT_EQ(lines(chunk), whole) << chunk;
}

}  // namespace
}  // namespace hueline::drivers
