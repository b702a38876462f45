#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/simulate/simulated_recording.hpp"
#include "core/calendar.hpp"
#include "runtime/outputs.hpp"
#include "runtime/pipeline.hpp"
#include "sim/wire/jpeg_planes_encode.hpp"
#include "sim/wire/timeline.hpp"
#include "storage/las_reader.hpp"
#include "tests/apps/program.hpp"
#include "tests/drivers/ladybug/pgr_writer.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"
#include "tests/sim/short_drive.hpp"
#include "tests/support/pcap_writer.hpp"
#include "tests/support/recorded_packets.hpp"
#include "tests/support/test_data.hpp"

/// Tests rigs of files: capture files and logs that other recorders made of one drive.
namespace hueline::apps {
namespace {

using namespace hueline::test;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr int kDrive_s = 14;  // the live clock needs ten of these seconds

/// Returns a drive northwards at 10 m/s, over the turn of a UTC hour.
sim::Drive drive_of_files() {
  sim::Drive drive = sim::test::short_drive(kDrive_s);
  drive.exposures.clear();
  for (auto& sample : drive.ins)
    sample.latitude_rad += 10.0 * static_cast<double>(sample.gps_ns - drive.begin_gps_ns) * 1e-9 / 6'371'000;
  for (auto& packet : drive.laser) packet.distance_2mm.assign(384, 5000);
  return drive;
}

const char* const kMount = "T_body_scanner: {position_m: [0, 0, 2], rotation_deg: [0, 0, 0]}";

std::string rig_of_files(const std::filesystem::path& dir, bool pos_first = true) {
  const std::string pos = "  - {name: pos, driver: novatel, file: " + (dir / "drive.gps").string() + "}\n";
  const std::string laser =
      "  - name: laser\n    driver: velodyne\n    model: VLP-16\n    pcap: {file: " + (dir / "drive.pcap").string() +
      ", ports: [2368, 8308]}\n    " + kMount + "\n";
  return "rig: files\nsensors:\n" + (pos_first ? pos + laser : laser + pos) + "colouring: {method: lens}\n";
}

/// Writes the drive as two other programs would record it: a receiver's log, and a capture file of a computer whose
/// clock is hours wrong and drifts.
void write_files(const sim::Timeline& timeline, const std::filesystem::path& dir, nanoseconds wall_clock_error) {
  PcapWriter capture;
  std::string log;
  for (const auto& event : timeline.events) {
    const std::string payload(reinterpret_cast<const char*>(event.payload.data()), event.payload.size());
    if (event.channel == sim::WireChannel::Pos) log += payload;
    if (event.channel != sim::WireChannel::LaserData && event.channel != sim::WireChannel::LaserPosition) continue;
    const std::int64_t unix_ns =
        timeline.begin_gps_ns + event.at_ns + 315'964'782'000'000'000 + event.at_ns / 20'000 + wall_clock_error.count();
    capture.frame(
        unix_ns,
        ethernet_frame(ipv4_packet(udp_segment(payload, event.channel == sim::WireChannel::LaserData ? 2368 : 8308))));
  }
  write_file(dir / "drive.gps", log);
  write_file(dir / "drive.pcap",
             std::string(reinterpret_cast<const char*>(capture.bytes().data()), capture.bytes().size()));
}

struct PlacedReturn {
  std::int64_t fired;  // in steps of 500 ns
  std::uint64_t ring;
  double x, y, z, sigma;
  auto key() const { return std::pair(fired, ring); }
};
/// Returns the points of a cloud in the order of their firing and ring, each once.
std::vector<PlacedReturn> cloud_of(const std::filesystem::path& path) {
  std::vector<PlacedReturn> out;
  auto reader = storage::LasReader::open(path);
  if (!reader.ok()) {
    ADD_FAILURE() << reader.error().message;
    return out;
  }
  const auto &channel = *reader->extra_field("channel"), &sigma = *reader->extra_field("sigma");
  std::vector<storage::LasPoint> batch;
  while (reader->next(batch).ok() && !batch.empty())
    for (const auto& p : batch)
      out.push_back({count_ns(*reader->gps_time(p)) / 500,
                     static_cast<std::uint64_t>(storage::LasReader::extra(p, channel)), p.x, p.y, p.z,
                     storage::LasReader::extra(p, sigma)});
  const auto begins_before = [](const auto& a, const auto& b) { return a.key() < b.key(); };
  const auto is_same = [](const auto& a, const auto& b) { return a.key() == b.key(); };
  std::stable_sort(out.begin(), out.end(), begins_before);
  out.erase(std::unique(out.begin(), out.end(), is_same), out.end());
  return out;
}

struct Difference {
  double worst_m = 0, worst_sigma = 0;
};
/// Returns how far two clouds of the same returns lie apart.
Difference difference_of(const std::vector<PlacedReturn>& one, const std::vector<PlacedReturn>& other) {
  Difference out;
  EXPECT_EQ(one.size(), other.size());
  for (std::size_t i = 0; i < std::min(one.size(), other.size()); ++i) {
    const PlacedReturn &a = one[i], &b = other[i];
    if (a.key() != b.key()) {
      ADD_FAILURE() << "one cloud has a return fired at " << a.fired << ", ring " << a.ring
                    << "; the other one fired at " << b.fired << ", ring " << b.ring;
      break;
    }
    out.worst_m = std::max(out.worst_m, std::hypot(a.x - b.x, a.y - b.y, a.z - b.z));
    out.worst_sigma = std::max(out.worst_sigma, std::abs(a.sigma - b.sigma));
  }
  return out;
}

std::uint64_t not_placed(const nlohmann::json& summary) {
  std::uint64_t sum = 0;
  for (const auto& [reason, count] : summary.at("points").at("not_placed").items()) sum += count.get<std::uint64_t>();
  return sum;
}

/// Captures the same drive live: the timeline's packets, as they arrive at a rig with a pulse per second.
void capture_live(const sim::Drive& drive, const sim::Timeline& timeline, const std::filesystem::path& dir) {
  const config::Rig rig = config::parse_rig(
      std::string("rig: live\nsensors:\n  - {name: pps, driver: pps, socket: /none}\n"
                  "  - {name: pos, driver: novatel, tcp: {host: 127.0.0.1, port: 3001}}\n"
                  "  - name: laser\n    driver: velodyne\n    model: VLP-16\n    udp: {ports: [2368, 8308]}\n    ") +
          kMount + "\ncolouring: {method: lens}\n",
      "live");
  auto outputs = runtime::Outputs::create(rig, dir, [](const std::string& trouble) { ADD_FAILURE() << trouble; });
  ASSERT_TRUE(outputs.ok());
  runtime::Pipeline pipeline(rig, 2, **outputs);
  ASSERT_TRUE(for_each_simulated_packet(drive, timeline, rig, [&](const Packet& packet) {
                pipeline.process(packet);
                return true;
              }).ok());
  pipeline.flush();
  pipeline.report((*outputs)->summary());
  ASSERT_TRUE((*outputs)->finish().ok());
}

/// Captures a rig whose points cannot be placed. The summary must say why, and count every return once.
nlohmann::json refused(const std::string& log, std::string& said, const std::string& ports = "") {
  TemporaryFolder dir;
  write_file(dir / "drive.gps", log);
  write_file(dir / "rig.yaml",
             "rig: files\nsensors:\n  - {name: pos, driver: novatel, file: " + (dir / "drive.gps").string() +
                 "}\n  - name: laser\n    driver: velodyne\n    model: VLP-16\n    pcap: {file: " +
                 (data_dir() / "velodyne/vlp16_gps.pcap").string() + ports + "}\n    " + kMount +
                 "\ncolouring: {method: lens}\n");
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--quiet"});
  EXPECT_EQ(capture.status, 5) << capture.said;
  said = capture.said;
  const auto summary = read_json(dir / "drive" / "summary.json");
  EXPECT_EQ(not_placed(summary), summary.at("points").at("returns").get<std::uint64_t>());
  return summary;
}
/// Returns a recording's packets with all that the journal holds of them, in its order. The bytes of two recordings may
/// differ all the same, because a chunk ends after 0.08 s of the computer's time.
std::vector<std::tuple<SensorId, PacketKind, bool, std::uint64_t, HostTime, std::string>> packets_of(
    const std::filesystem::path& file) {
  std::vector<std::tuple<SensorId, PacketKind, bool, std::uint64_t, HostTime, std::string>> out;
  test::for_each_recorded_packet(file, [&](const Packet& packet, const storage::JournalHeader&) {
    const auto bytes = packet.bytes.bytes();
    out.emplace_back(packet.sensor, packet.kind, packet.shed, packet.sequence, packet.received,
                     std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  });
  EXPECT_GT(out.size(), 1000u);
  return out;
}
std::string text_of(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

/// The same in the released program, another compiler's: for what the program with the sanitizers has done already.
Ran run_released(const std::vector<std::string>& arguments) { return run(arguments, HUELINE_RELEASED); }

TEST(FileRig, PlacesWhatTheLiveRigPlaces) {
  TemporaryFolder dir;
  const sim::Drive drive = drive_of_files();
  const auto timeline = sim::build_timeline(drive, {});
  ASSERT_TRUE(timeline.ok()) << timeline.error().message;
  capture_live(drive, *timeline, dir / "live");
  const auto live = cloud_of(dir / "live" / "cloud.las");
  ASSERT_GT(live.size(), 1'000'000u);

  write_files(*timeline, dir.path(), -std::chrono::hours(31));
  write_file(dir / "rig.yaml", rig_of_files(dir.path()));
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--quiet"});
  ASSERT_EQ(capture.status, 0) << capture.said;
  const auto files = cloud_of(dir / "drive" / "cloud.las");
  const auto summary = read_json(dir / "drive" / "summary.json");
  EXPECT_EQ(summary.at("points").at("total").get<std::uint64_t>() + not_placed(summary), drive.laser.size() * 384);
  const Difference difference = difference_of(live, files);
  EXPECT_LE(difference.worst_m, 0.001);  // one step of the file's coordinates
  EXPECT_LE(difference.worst_sigma, 1e-4);
  ASSERT_EQ(summary.at("clocks").size(), 1u);
  EXPECT_EQ(summary.at("clocks")[0].at("clock"), "laser");
  EXPECT_EQ(summary.at("clocks")[0].at("state"), "Locked");

  // Checks what the recording says of itself, and a replay at a pace.
  const Ran inspected = run({"inspect", "--json", dir / "drive" / "drive.mcap"});
  const auto found = nlohmann::json::parse(inspected.said);
  EXPECT_NEAR(found.at("duration_s").get<double>(), kDrive_s, 0.5) << inspected.said;
  EXPECT_THAT(inspected.said, HasSubstr("\"scanner_clock\""));
  EXPECT_THAT(inspected.said, HasSubstr("PPS locked, RMC valid"));
  const Ran replay = run_released({"replay", dir / "drive" / "drive.mcap", "--out", dir / "again", "--speed", "20"});
  EXPECT_EQ(replay.status, 0) << replay.said;
  for (const char* file : {"cloud.las", "view.mcap", "summary.json"})
    EXPECT_TRUE(contents(dir / "drive" / file) == contents(dir / "again" / file)) << file;

  // Neither the number of threads nor the order in the rig changes the order of the journal.
  ASSERT_EQ(run_released({"capture", dir / "rig.yaml", "--out", dir / "second", "--quiet"}).status, 0);
  EXPECT_TRUE(packets_of(dir / "drive" / "drive.mcap") == packets_of(dir / "second" / "drive.mcap"));
  write_file(dir / "rig.yaml", rig_of_files(dir.path(), false));
  ASSERT_EQ(run_released({"capture", dir / "rig.yaml", "--out", dir / "turned", "--quiet"}).status, 0);
  EXPECT_EQ(cloud_of(dir / "turned" / "cloud.las").size(), files.size());
}

/// Writes the solutions of a drive as an SBET: the trajectory that an office has calculated from them.
void write_sbet(const sim::Drive& drive, const std::filesystem::path& file) {
  std::string bytes;
  for (const sim::InsSample& one : drive.ins) {
    const std::array<double, 17> record{to_seconds(to_gps_week(gps_time_ns(one.gps_ns)).time_of_week),
                                        one.latitude_rad,
                                        one.longitude_rad,
                                        one.ellipsoidal_height_m,
                                        0,
                                        0,
                                        0,
                                        one.roll_rad,
                                        one.pitch_rad,
                                        one.heading_rad};
    bytes.append(reinterpret_cast<const char*>(record.data()), sizeof(record));
  }
  write_file(file, bytes);
}

/// A scanner's capture file and a trajectory from post-processing are enough: no log of the POS.
TEST(FileRig, PlacesByATrajectoryFromPostProcessingAlone) {
  TemporaryFolder dir;
  const sim::Drive drive = drive_of_files();
  const auto timeline = sim::build_timeline(drive, {});
  ASSERT_TRUE(timeline.ok()) << timeline.error().message;
  write_files(*timeline, dir.path(), seconds(0));
  write_file(dir / "rig.yaml", rig_of_files(dir.path()));
  ASSERT_EQ(run_released({"capture", dir / "rig.yaml", "--out", dir / "log", "--quiet"}).status, 0);
  write_sbet(drive, dir / "drive.sbet");
  std::string rig = rig_of_files(dir.path());
  const std::string by_log = "driver: novatel, file: " + (dir / "drive.gps").string();
  ASSERT_NE(rig.find(by_log), std::string::npos);
  const auto rig_with = [&](const std::string& week) {
    std::string changed = rig;
    return changed.replace(changed.find(by_log), by_log.size(),
                           "driver: sbet, file: " + (dir / "drive.sbet").string() + week);
  };
  write_file(dir / "rig.yaml", rig_with(""));
  EXPECT_THAT(run({"capture", dir / "rig.yaml", "--out", dir / "none", "--quiet"}).said, HasSubstr("week"));
  write_file(dir / "rig.yaml", rig_with(fmt::format(", week: {}", to_gps_week(gps_time_ns(drive.begin_gps_ns)).week)));
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "sbet", "--quiet"});
  ASSERT_EQ(capture.status, 0) << capture.said;
  const auto by_novatel = cloud_of(dir / "log" / "cloud.las"), by_sbet = cloud_of(dir / "sbet" / "cloud.las");
  EXPECT_GT(by_sbet.size(), 1'000'000u);
  EXPECT_LE(difference_of(by_novatel, by_sbet).worst_m, 0.002);
}

/// Returns navigation solutions at 100 Hz, driving north from `begin` on.
std::string solutions(GpsTime begin, seconds length, std::uint32_t status = 3) {
  std::string log;
  for (int i = 0; i <= 100 * length.count(); ++i) {
    const auto time = to_gps_week(begin + std::chrono::milliseconds(10 * i));
    Pva pva;
    pva.week = static_cast<unsigned>(time.week);
    pva.seconds = to_seconds(time.time_of_week);
    pva.latitude_deg = 36.8 + 9e-7 * i;
    pva.longitude_deg = -2.4;
    pva.north = 10;
    pva.status = status;
    const auto bytes = inspvas(pva);
    log.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  return log;
}

std::string rig_of_gps_capture(const std::filesystem::path& log) {
  return "rig: files\nsensors:\n  - {name: pos, driver: novatel, file: " + log.string() +
         "}\n  - name: laser\n    driver: velodyne\n    model: VLP-16\n" +
         "    pcap: {file: " + (data_dir() / "velodyne/vlp16_gps.pcap").string() + "}\n    " + kMount +
         "\ncolouring: {method: lens}\n";
}

/// The data of a real scanner on PPS with a valid GPRMC of 2016-01-21 08:18:02 UTC, and a log of the same time.
TEST(FileRig, PlacesARealCaptureBesideALogOfItsTime) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  TemporaryFolder dir;
  const GpsTime begin = *from_utc({2016, 1, 21, 8, 18, 0, 0});
  write_file(dir / "drive.gps", solutions(begin, seconds(5)));
  write_file(dir / "rig.yaml", rig_of_gps_capture(dir / "drive.gps"));
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--quiet"});
  EXPECT_EQ(capture.status, 0) << capture.said;
  const auto summary = read_json(dir / "drive" / "summary.json");
  EXPECT_EQ(summary.at("points").at("total"), 73486) << capture.said;
  EXPECT_EQ(not_placed(summary), 0u);
  for (const PlacedReturn& point : cloud_of(dir / "drive" / "cloud.las"))
    ASSERT_NEAR(static_cast<double>(point.fired) * 500e-9, to_seconds(begin.time_since_epoch()) + 2.53, 0.2);
}

/// The log begins long before the capture file and ends long after it. It has more poses than are kept at once.
TEST(FileRig, ReadsALongLogNoFartherThanTheCaptureNeeds) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  TemporaryFolder dir;
  write_file(dir / "drive.gps", solutions(*from_utc({2016, 1, 21, 8, 17, 0, 0}), seconds(2200)));
  write_file(dir / "rig.yaml", rig_of_gps_capture(dir / "drive.gps"));
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--quiet"});
  EXPECT_EQ(capture.status, 0) << capture.said;
  EXPECT_EQ(read_json(dir / "drive" / "summary.json").at("points").at("total"), 73486) << capture.said;
}

/// Returns the same poses as the sender's log in ASCII.
std::string in_ascii(GpsTime begin, seconds length) {
  std::string log = "\r\n<OK\r\n[COM1]";
  for (int i = 0; i <= 100 * length.count(); ++i) {
    const auto time = to_gps_week(begin + std::chrono::milliseconds(10 * i));
    const std::string inside = fmt::format(
        "INSPVASA,{0},{1:.3f};{0},{1:.9f},{2:.11f},-2.40000000000,0.0000,10.0000,0.0000,0.0000,0.0,0.0,0.0,INS_"
        "SOLUTION_GOOD",
        time.week, to_seconds(time.time_of_week), 36.8 + 9e-7 * i);
    log += fmt::format("%{}*{:08x}\r\n", inside, bitwise_crc(std::as_bytes(std::span(inside))));
  }
  return log;
}

TEST(FileRig, PlacesByAnAsciiLog) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  TemporaryFolder dir;
  write_file(dir / "drive.gps", in_ascii(*from_utc({2016, 1, 21, 8, 18, 0, 0}), seconds(5)));
  write_file(dir / "rig.yaml", rig_of_gps_capture(dir / "drive.gps"));
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--quiet"});
  EXPECT_EQ(capture.status, 0) << capture.said;
  EXPECT_EQ(read_json(dir / "drive" / "summary.json").at("points").at("total"), 73486) << capture.said;
}

TEST(FileRig, SaysWhyNothingIsPlaced) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  const GpsTime begin = *from_utc({2016, 1, 21, 8, 18, 0, 0});
  std::string said;
  const auto reason = [](const nlohmann::json& summary) { return summary.at("points").at("not_placed").dump(); };

  EXPECT_THAT(reason(refused("", said)), HasSubstr("the POS sent nothing"));
  EXPECT_THAT(said, HasSubstr("pos        no packet came"));

  const auto week = to_gps_week(begin);
  Put position;
  position.u32(0)
      .u32(56)
      .f64(36.8)
      .f64(-2.4)
      .f64(10)
      .f32(50)
      .u32(61)
      .f32(1)
      .f32(1)
      .f32(1)
      .text("AAAA")
      .f32(0)
      .f32(0)
      .u32(0)
      .u32(0);
  const auto bestpos = long_message(42, static_cast<unsigned>(week.week),
                                    static_cast<std::uint32_t>(week.time_of_week.count() / 1'000'000), position.bytes);
  EXPECT_THAT(reason(refused(text_of(bestpos), said)), HasSubstr("the POS sent no navigation solution"));
  EXPECT_THAT(said, HasSubstr("the POS sent 1 BESTPOS"));

  const auto aligning = refused(solutions(begin, seconds(5), 1), said);
  EXPECT_THAT(reason(aligning), HasSubstr("the POS gave no good solution"));
  EXPECT_NEAR(aligning.at("drive").at("not_good_s").at("aligning").get<double>(), 5.0, 0.02);
  EXPECT_THAT(said, HasSubstr("501 POS solutions not used, 5.0 s; the receiver says: aligning"));

  EXPECT_THAT(reason(refused(solutions(begin + std::chrono::hours(1), seconds(5)), said)),
              HasSubstr("older than the first good POS solution"));

  // The port is wrong, so nothing is decoded, and the message names the ports of the capture file.
  refused(solutions(begin, seconds(5)), said, ", ports: [2400]");
  EXPECT_THAT(said, HasSubstr("laser      no packet came"));
  EXPECT_THAT(said, HasSubstr("there are datagrams to the ports 2368 (293), 8308 (57)"));
}

/// The drive's exposures in a stream file of a Ladybug, each of one grey that its number gives. The camera's clock is
/// on UTC but for `error`; its stamp is the end of the exposure.
void write_pgr_file(const sim::Drive& drive, const std::filesystem::path& file, nanoseconds error) {
  PgrStream stream;
  for (const sim::CameraExposure& exposure : drive.exposures) {
    const std::vector<std::uint8_t> mosaic(144 * 64, static_cast<std::uint8_t>(40 + 6 * exposure.number));
    sim::JpegPlanesImage image;
    image.mosaic = mosaic;
    image.width = 144;
    image.height = 64;
    image.sequence = exposure.number;
    image.quality = 100;
    const std::int64_t end = exposure.exposure_start_gps_ns + exposure.exposure_ns + error.count();
    image.unix_us = (end + 315'964'782'000'000'000) / 1000;
    const auto bytes = sim::encode_jpeg_planes(image);
    ASSERT_TRUE(bytes.ok());
    stream.images.push_back(*bytes);
  }
  write_file(file, text_of(write_pgr(stream)));
}

/// A Ladybug's stream file beside the log and the capture file colours the points, each by the exposure of its time:
/// by the receiver's event marks, which correct the camera's clock, or by the camera's clock alone.
TEST(FileRig, ALadybugsStreamFileColoursThePoints) {
  TemporaryFolder dir;
  sim::Drive drive = drive_of_files();
  drive.exposures = sim::test::short_drive(kDrive_s).exposures;
  const auto timeline = sim::build_timeline(drive, {});
  ASSERT_TRUE(timeline.ok()) << timeline.error().message;
  write_files(*timeline, dir.path(), std::chrono::hours(3));
  for (const bool has_marks : {true, false}) {
    write_pgr_file(drive, dir / "drive-000000.pgr", has_marks ? std::chrono::milliseconds(7) : nanoseconds(0));
    std::string rig = rig_of_files(dir.path());
    rig = rig.substr(0, rig.find("colouring:"));
    rig += fmt::format(
        "  - {{name: camera, driver: ladybug, file: {}, width: 144, height: 64, pixel_format: BayerRG8, lens_columns: "
        "3,\n"
        "     stamp: utc, stamp_event: exposure_end, exposure_us: 2000, event_input: {}}}\n"
        "head:\n  T_body_head: {{position_m: [0, 0, 2], rotation_deg: [0, 0, 90]}}\n"
        "  panorama: {{width: 800, height: 400, stitching_radius_m: 20}}\n"
        "  lenses:\n    - {{name: front, camera: camera, offset_px: [0, 0], width: 48, height: 32, model: brown,\n"
        "       focal_px: [16, 16], principal_point_px: [23.5, 15.5], distortion: [],\n"
        "       T_head_lens: {{position_m: [0, 0, 0], rotation_matrix: [0, 0, 1, -1, 0, 0, 0, -1, 0]}}}}\n"
        "colouring: {{method: lens, choice: nearest, rendering: as_delivered, neighbours: 0}}\n",
        (dir / "drive-000000.pgr").string(), has_marks ? 1 : 0);
    write_file(dir / "rig.yaml", rig);
    const std::string out = has_marks ? "marks" : "clock";
    // One lens sees a third of the points: the verdict is to drive again.
    const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / out, "--quiet"});
    EXPECT_EQ(capture.status, 8) << capture.said;
    const auto summary = read_json(dir / out / "summary.json");
    const auto& timing = summary.at("exposures").at("by_timing");
    const auto images = drive.exposures.size();
    EXPECT_EQ(timing.at(has_marks ? "EventMark" : "CameraClock").get<std::size_t>(), images) << timing.dump();

    auto reader = storage::LasReader::open(dir / out / "cloud.las");
    ASSERT_TRUE(reader.ok());
    const auto &number = *reader->extra_field("exposure"), &state = *reader->extra_field("colour_state");
    std::vector<storage::LasPoint> batch;
    std::uint64_t coloured = 0, wrong_colour = 0, wrong_time = 0;
    while (reader->next(batch).ok() && !batch.empty())
      for (const auto& p : batch) {
        if (storage::LasReader::extra(p, state) > 1) continue;
        ++coloured;
        const auto index = static_cast<std::size_t>(storage::LasReader::extra(p, number));
        ASSERT_LT(index, images);
        wrong_colour += std::abs(p.red / 257.0 - (40.0 + 6.0 * static_cast<double>(index))) > 3 ? 1U : 0U;
        const double away_s =
            1e-9 * static_cast<double>(count_ns(*reader->gps_time(p)) - drive.exposures[index].exposure_start_gps_ns);
        wrong_time += std::abs(away_s - 0.001) > 0.252 ? 1U : 0U;  // half the interval, and the length of a packet
      }
    EXPECT_GT(coloured, 100'000u) << capture.said;
    EXPECT_EQ(wrong_colour, 0u);
    EXPECT_EQ(wrong_time, 0u);
    const Ran replay = run({"replay", dir / out / "drive.mcap", "--out", dir / "again"});
    EXPECT_EQ(replay.status, 8) << replay.said;
    // Of an earlier, longer run; behind a gap are the files of something else.
    for (const char* file_number : {"000000", "000001", "000002", "000004"})
      write_file(dir / fmt::format("out-{}.pgr", file_number), "earlier");
    const Ran extract = run({"extract", dir / out, "--sensor", "camera", "--out", dir / "out-000000.pgr"});
    EXPECT_EQ(extract.status, 0) << extract.said;
    EXPECT_THAT(extract.said, HasSubstr("out-000001.pgr to before out-000003.pgr, of an earlier and longer run, were "
                                        "removed"));
    EXPECT_FALSE(std::filesystem::exists(dir / "out-000001.pgr") || std::filesystem::exists(dir / "out-000002.pgr"));
    EXPECT_TRUE(std::filesystem::exists(dir / "out-000004.pgr"));
    EXPECT_TRUE(contents(dir / "out-000000.pgr") == contents(dir / "drive-000000.pgr")) << extract.said;
    const Ran unnumbered = run({"extract", dir / out, "--sensor", "camera", "--out", dir / "out.pgr"});
    EXPECT_EQ(unnumbered.status, 2) << unnumbered.said;
    for (const char* file : {"cloud.las", "summary.json"})
      EXPECT_TRUE(contents(dir / out / file) == contents(dir / "again" / file)) << file;
  }
}

}  // namespace
}  // namespace hueline::apps
