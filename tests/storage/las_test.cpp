#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "storage/cloud_crs.hpp"
#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "tests/storage/las_points.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_cloud;
using test::sample_origin;
using test::TemporaryFolder;

LasWriter::Config sample_config() {
  LasWriter::Config config;
  config.created = {2026, 3, 1, 12, 0, 0, 0};
  return config;
}

void write_cloud(const std::filesystem::path& path, const std::vector<CloudBlock>& blocks,
                 LasWriter::Config config = sample_config()) {
  auto writer = LasWriter::create(path, sample_origin(), config);
  ASSERT_TRUE(writer) << writer.error().message;
  for (const CloudBlock& block : blocks) ASSERT_TRUE(writer->append(block));
  ASSERT_TRUE(writer->close());
}

TEST(Las, GivesBackEveryPoint) {
  const TemporaryFolder folder;
  const CloudBlock cloud = sample_cloud(40'000);
  write_cloud(folder / "cloud.las", {cloud});
  auto reader = LasReader::open(folder / "cloud.las");
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(reader->header().point_count, 40'000u);
  EXPECT_EQ(reader->header().creation_day, 60);
  EXPECT_EQ(reader->header().creation_year, 2026);
  EXPECT_EQ(reader->header().points_by_return[0] + reader->header().points_by_return[1], 40'000u);
  EXPECT_NE(reader->wkt().find("UTM zone 32N"), std::string::npos);
  auto projection = Projection::create(sample_origin());
  std::size_t i = 0;
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  for (std::vector<LasPoint> points; reader->next(points, 999) && !points.empty();)
    for (const LasPoint& p : points) {
      const ColouredPoint& q = cloud.points[i++];
      const Eigen::Vector3d exact = projection->project_exactly(q.east, q.north, q.up);
      ASSERT_NEAR(p.x, exact.x(), 0.00051);
      ASSERT_NEAR(p.y, exact.y(), 0.00051);
      ASSERT_NEAR(p.z, exact.z(), 0.00051);
      const double xyz[] = {p.x, p.y, p.z};
      for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], xyz[k]), high[k] = std::max(high[k], xyz[k]);
      ASSERT_NEAR(to_seconds(*reader->gps_time(p) - q.time), 0, 1e-7);
      for (const int colour : {p.red, p.green, p.blue, p.intensity}) ASSERT_EQ(colour % 257, 0);
      ColouredPoint back;
      back.east = q.east, back.north = q.north, back.up = q.up, back.time = q.time;
      back.red = static_cast<std::uint8_t>(p.red / 257), back.green = static_cast<std::uint8_t>(p.green / 257),
      back.blue = static_cast<std::uint8_t>(p.blue / 257);
      back.reflectivity = static_cast<std::uint8_t>(p.intensity / 257);
      back.return_number = p.return_number, back.return_count = p.return_count;
      back.sensor = p.source;
      test::read_extra<kPointFields>(*reader, p, back);
      ASSERT_TRUE(back == q) << i;
    }
  EXPECT_EQ(i, cloud.points.size());
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(reader->header().minimum[k], low[k], 1e-9);
    EXPECT_NEAR(reader->header().maximum[k], high[k], 1e-9);
  }
}

TEST(Las, TheSampleCloudHasEveryField) {
  const CloudBlock cloud = sample_cloud(100);
  for_each_field<kPointFields>([&](auto field) {
    const auto differs = [&](const ColouredPoint& p) { return field.number(p) != field.number(cloud.points.front()); };
    EXPECT_TRUE(std::any_of(cloud.points.begin(), cloud.points.end(), differs))
        << field.entry.name << " is the same in all points: a writer that forgets it is not seen";
  });
}

/// A point with fields that ColouredPoint does not have: how many exposures see it, and how well its time is known.
struct SeenPoint : ColouredPoint {
  std::uint8_t views = 0;
  std::uint16_t time_sigma = 0;
};
constexpr auto kSeenFields =
    std::tuple_cat(kPointFields, std::tuple{
                                     PointField{&SeenPoint::views, "views", "", "How many exposures see it.",
                                                las_extra("views", "exposures that see it"), "views"},
                                     PointField{&SeenPoint::time_sigma, "time sigma", "s", "One sigma of its time.",
                                                las_extra("time_sigma", "1-sigma of the time, s", 1e-7)},
                                 });

TEST(Las, AMadeUpFieldIsOneEntryOfTheList) {
  const TemporaryFolder folder;
  std::vector<SeenPoint> points;
  for (const ColouredPoint& p : sample_cloud(3000).points)
    points.push_back({p, static_cast<std::uint8_t>(points.size() % 9), static_cast<std::uint16_t>(20 * points.size())});
  {
    auto writer = LasWriter::create<kSeenFields>(folder / "cloud.las", sample_origin(), sample_config());
    ASSERT_TRUE(writer) << writer.error().message;
    ASSERT_TRUE(writer->append<kSeenFields>(sample_origin(), std::span<const SeenPoint>(points)));
    EXPECT_EQ(writer->append(sample_cloud(1)).error().code, ErrorCode::Invalid) << "a point without the file's fields";
  }
  auto reader = LasReader::open(folder / "cloud.las");
  ASSERT_TRUE(reader) << reader.error().message;
  ASSERT_NE(reader->extra_field("time_sigma"), nullptr);
  EXPECT_EQ(reader->extra_field("time_sigma")->description, "1-sigma of the time, s");
  std::vector<LasPoint> records;
  ASSERT_TRUE(reader->next(records));
  ASSERT_EQ(records.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(LasReader::extra(records[i], *reader->extra_field("time_sigma")), 2e-6 * static_cast<double>(i), 1e-12);
    SeenPoint back;
    test::read_extra<kSeenFields>(*reader, records[i], back);
    ASSERT_EQ(back.views, points[i].views);
    ASSERT_EQ(back.time_sigma, points[i].time_sigma);
    ASSERT_EQ(back.v, points[i].v) << "beside the fields that every point has";
  }
}

TEST(Las, BytesDoNotDependOnTheBlocksOrTheHeaderUpdates) {
  const TemporaryFolder folder;
  write_cloud(folder / "a.las", {sample_cloud(5000)});
  auto config = sample_config();
  config.header_every = 100;
  write_cloud(folder / "b.las", {sample_cloud(1000), sample_cloud(0), sample_cloud(3999, 1000), sample_cloud(1, 4999)},
              config);
  EXPECT_EQ(test::contents(folder / "a.las"), test::contents(folder / "b.las"));
}

TEST(Las, TimeIsAdjustedStandardGpsTime) {
  // 2011-09-14T01:46:25 UTC is GPS second 1 000 000 000 (15 leap seconds then): adjusted time 0.
  EXPECT_EQ(to_las_time(*from_utc({2011, 9, 14, 1, 46, 25, 0})), 0.0);
  EXPECT_EQ(from_las_time(-0.25), gps_time_ns(999'999'999'750'000'000ll));
}

TEST(Las, CountsPointsThatHaveNoPlace) {
  const TemporaryFolder folder;
  CloudBlock cloud = sample_cloud(10);
  cloud.points[3].east = NAN;
  cloud.points[7].up = 1e7;
  auto writer = LasWriter::create(folder / "cloud.las", sample_origin(), sample_config());
  ASSERT_TRUE(writer->append(cloud));
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(writer->counts().written, 8u);
  EXPECT_EQ(writer->counts().refused, 2u);
  EXPECT_EQ(writer->append({{}, {}}).error().code, ErrorCode::Invalid) << "another origin";
}

TEST(Las, AnEmptyCloudIsAFileToo) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", {});
  auto reader = LasReader::open(folder / "cloud.las");
  ASSERT_TRUE(reader);
  std::vector<LasPoint> points;
  EXPECT_TRUE(reader->next(points));
  EXPECT_TRUE(points.empty());
}

TEST(Las, AKilledWriterLeavesAFileThatReadsToItsLastHeader) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.las";
  const pid_t child = ::fork();
  if (child == 0) {
    auto config = sample_config();
    config.header_every = 20'000;
    auto writer = LasWriter::create(path, sample_origin(), config);
    for (std::size_t i = 0; i < 9; ++i)
      if (!writer->append(sample_cloud(5'000, i * 5'000))) ::_exit(1);
    ::_exit(0);
  }
  int result = 0;
  ::waitpid(child, &result, 0);
  ASSERT_EQ(result, 0);
  auto reader = LasReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(reader->header().point_count, 40'000u);
  std::vector<LasPoint> points;
  std::size_t read = 0;
  while (reader->next(points) && !points.empty()) read += points.size();
  EXPECT_EQ(read, 40'000u);
}

TEST(Las, WhatWasWrittenBeforeARefusedWriteReads) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.las";
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{2'000'000, 2'000'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    auto writer = LasWriter::create(path, sample_origin(), sample_config());
    const Status appended = writer->append(sample_cloud(60'000));
    if (appended || appended.error().code != ErrorCode::Io) ::_exit(1);
    const Status closed = writer->close();
    if (closed || closed.error().message != appended.error().message) ::_exit(2);
    if (writer->counts().written == 0 || writer->counts().lost == 0) ::_exit(3);
    if (writer->header().point_count != writer->counts().written) ::_exit(4);
    ::_exit(0);
  }
  int result = 0;
  ::waitpid(child, &result, 0);
  ASSERT_EQ(result, 0);
  auto reader = LasReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(std::filesystem::file_size(path),
            reader->header().point_offset + reader->header().point_count * reader->header().point_size);
  EXPECT_GT(reader->header().point_count, 10'000u);
}

TEST(LasWriter, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(LasWriter::create("/nonexistent/cloud.las", sample_origin(), sample_config()).error().code, ErrorCode::Io);
  auto config = sample_config();
  config.map.crs = "EPSG:4326";
  EXPECT_EQ(LasWriter::create(folder / "cloud.las", sample_origin(), config).error().code, ErrorCode::Invalid);
  EXPECT_FALSE(std::filesystem::exists(folder / "cloud.las"));
  config = sample_config();
  config.header_every = 0;
  EXPECT_NE(config.validate().find("header_every"), std::string::npos);
}

TEST(LasReader, TellsACutFileAfterItsWholePoints) {
  const TemporaryFolder folder;
  const auto path = folder / "cloud.las";
  write_cloud(path, {sample_cloud(100)});
  const auto size = std::filesystem::file_size(path);
  auto reader = LasReader::open(path);
  const std::size_t point_size = reader->header().point_size;
  for (std::size_t cut = 1; cut <= size; ++cut) {
    std::filesystem::resize_file(path, size - cut);
    auto cut_reader = LasReader::open(path);
    if (!cut_reader) {
      ASSERT_LT(size - cut, reader->header().point_offset) << cut_reader.error().message;
      continue;
    }
    std::vector<LasPoint> points;
    ASSERT_TRUE(cut_reader->next(points) || size - cut < reader->header().point_offset + point_size);
    ASSERT_EQ(points.size(), (size - cut - reader->header().point_offset) / point_size);
    const Status end = cut_reader->next(points);
    ASSERT_FALSE(end);
    ASSERT_EQ(end.error().code, ErrorCode::Truncated);
  }
}

/// Files of other versions, written by hand from the tables of ASPRS.
TEST(LasReader, ReadsOlderVersionsAndFormats) {
  const TemporaryFolder folder;
  for (int format = 0; format <= 5; ++format) {
    Bytes file(227);
    std::memcpy(file.data(), "LASF", 4);
    const std::span<std::byte> f(file);
    put<std::uint8_t>(f, 24, 1), put<std::uint8_t>(f, 25, 2);
    put<std::uint16_t>(f, 94, 227);
    put<std::uint32_t>(f, 96, 227);
    put(f, 104, static_cast<std::uint8_t>(format));
    const std::uint16_t sizes[] = {20, 28, 26, 34, 57, 63};
    put(f, 105, sizes[format]);
    put<std::uint32_t>(f, 107, 1), put<std::uint32_t>(f, 111, 1);
    for (std::size_t k = 0; k < 3; ++k) put(f, 131 + 8 * k, 0.01), put(f, 155 + 8 * k, 1000.0 * static_cast<double>(k));
    Bytes point(sizes[format]);
    const std::span<std::byte> p(point);
    put<std::int32_t>(p, 0, -150), put<std::int32_t>(p, 4, 200), put<std::int32_t>(p, 8, 1);
    put<std::uint16_t>(p, 12, 777);
    put<std::uint8_t>(p, 14, 2 | 3 << 3 | 1 << 6);
    put<std::uint8_t>(p, 15, 0xA0 | 9);  // water, with flags
    put<std::int8_t>(p, 16, -12);
    put<std::uint16_t>(p, 18, 42);
    const std::size_t time[] = {0, 20, 0, 20, 20, 20}, colour[] = {0, 0, 20, 28, 0, 28};
    if (time[format]) put(p, time[format], 345678.5);
    if (colour[format]) put<std::uint16_t>(p, colour[format] + 2, 0xABCD);
    append(file, ByteView(point));
    test::write_file(folder / "old.las", {reinterpret_cast<const char*>(file.data()), file.size()});
    auto reader = LasReader::open(folder / "old.las");
    ASSERT_TRUE(reader) << reader.error().message;
    std::vector<LasPoint> points;
    ASSERT_TRUE(reader->next(points));
    ASSERT_EQ(points.size(), 1u);
    EXPECT_EQ(points[0].x, -1.5);
    EXPECT_EQ(points[0].y, 1002.0);
    EXPECT_EQ(points[0].intensity, 777);
    EXPECT_EQ(points[0].return_number, 2);
    EXPECT_EQ(points[0].return_count, 3);
    EXPECT_EQ(points[0].classification, 9);
    EXPECT_EQ(points[0].scan_angle_deg, -12);
    EXPECT_EQ(points[0].source, 42);
    EXPECT_EQ(points[0].time.has_value(), time[format] != 0);
    EXPECT_FALSE(reader->gps_time(points[0])) << "time of week has no week";
    EXPECT_EQ(points[0].green, colour[format] ? 0xABCD : 0);
  }
}

/// A LAS 1.4 file of one point of format 7 with `extra` bytes, with records in front of the point and behind it.
Bytes file_with_records(const std::vector<LasVlr>& records, const std::vector<LasVlr>& extended, const Bytes& extra) {
  LasHeader header;
  header.point_format = 7;
  header.point_size = static_cast<std::uint16_t>(36 + extra.size());
  header.point_count = 1;
  header.header_size = kLasHeaderSize14;
  header.vlr_count = static_cast<std::uint32_t>(records.size());
  Bytes vlrs;
  for (const LasVlr& record : records) append_vlr(vlrs, record);
  header.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + vlrs.size());
  header.evlr_offset = header.point_offset + header.point_size;
  header.evlr_count = static_cast<std::uint32_t>(extended.size());
  Bytes file = encode_las_header(header);
  append(file, ByteView(vlrs));
  Bytes point(36);
  put<std::uint16_t>(std::span<std::byte>(point), 32, 200);
  append(file, ByteView(point)), append(file, ByteView(extra));
  for (const LasVlr& record : extended) {
    append_evlr_head(file, record.user_id, record.record_id, record.description, record.data.size());
    append(file, as_bytes(record.data));
  }
  return file;
}

LasVlr extra_bytes_record(const LasExtraField& field) { return {"LASF_Spec", 4, "", encode_extra_fields({field})}; }

TEST(LasReader, ReadsExtraBytesOfSeveralRecordsAndArrays) {
  const TemporaryFolder folder;
  LasExtraField deviation, pair, confidence;
  deviation.name = "Deviation";
  deviation.type = LasType::U16;
  pair.name = "pair";
  confidence.name = "confidence";
  std::string array = encode_extra_fields({pair});
  array[2] = 11;  // two bytes
  const Bytes extra{std::byte{0x34}, std::byte{0x12}, std::byte{7}, std::byte{9}, std::byte{65}};
  const Bytes file = file_with_records({extra_bytes_record(deviation), {"LASF_Spec", 4, "", array}},
                                       {extra_bytes_record(confidence)}, extra);
  test::write_file(folder / "a.las", {reinterpret_cast<const char*>(file.data()), file.size()});
  auto reader = LasReader::open(folder / "a.las");
  ASSERT_TRUE(reader) << reader.error().message;
  std::vector<LasPoint> points;
  ASSERT_TRUE(reader->next(points));
  std::map<std::string, double> values;
  for (const LasExtraField& field : reader->extra_fields()) values[field.name] = LasReader::extra(points.at(0), field);
  EXPECT_EQ(values,
            (std::map<std::string, double>{{"Deviation", 0x1234}, {"pair[0]", 7}, {"pair[1]", 9}, {"confidence", 65}}));
}

TEST(LasReader, ReadsTheRecordsBehindThePointsAndNamesThoseItLeavesOut) {
  const TemporaryFolder folder;
  const std::string wkt = "LOCAL_CS[\"a site\"]";
  const Bytes file = file_with_records({},
                                       {{"waves", 7, "", std::string(70'000, 'w')},
                                        {"LASF_Projection", 2112, "", wkt + '\0'},
                                        {"office", 42, "", "a note"}},
                                       {});
  const auto read = [&](std::size_t size) {
    test::write_file(folder / "a.las", {reinterpret_cast<const char*>(file.data()), size});
    auto reader = LasReader::open(folder / "a.las");
    EXPECT_TRUE(reader.ok());
    return std::pair(reader->wkt(), reader->left_out());
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(read(file.size()), std::pair(wkt, Names{"extended record waves/7 of 70000 bytes"}));
  const auto [cut_wkt, cut] = read(file.size() - 3);
  EXPECT_EQ(cut_wkt, wkt);
  EXPECT_EQ(cut.back(), "the file ends inside extended record office/42");
  EXPECT_EQ(read(kLasHeaderSize14 + 36 + 10).second, Names{"the file ends before extended record 0 of 3"});
}

TEST(LasReader, KnowsColoursOfEightBits) {
  const TemporaryFolder folder;
  const auto has_byte_colours = [&](std::uint16_t green) {
    Bytes file = file_with_records({}, {}, {});
    put<std::uint16_t>(std::span<std::byte>(file), kLasHeaderSize14 + 32, green);
    test::write_file(folder / "a.las", {reinterpret_cast<const char*>(file.data()), file.size()});
    auto reader = LasReader::open(folder / "a.las");
    const bool out = *reader->has_byte_colours();
    std::vector<LasPoint> points;
    EXPECT_TRUE(reader->next(points));
    EXPECT_EQ(points.size(), 1u) << "the reader is at its begin again";
    return out;
  };
  EXPECT_TRUE(has_byte_colours(255));
  EXPECT_FALSE(has_byte_colours(256));
}

/// The record of GeoTIFF keys: key, value, key, value ...
LasVlr geo_keys(const std::vector<std::uint16_t>& values) {
  Bytes data;
  for (const std::uint16_t value : std::array<std::uint16_t, 3>{1, 1, 0}) append(data, value);
  append(data, static_cast<std::uint16_t>(values.size() / 2));
  for (std::size_t i = 0; i < values.size(); i += 2) {
    append(data, values[i]);
    for (const std::uint16_t value : std::array<std::uint16_t, 3>{0, 1, values[i + 1]}) append(data, value);
  }
  return {"LASF_Projection", 34735, "", {reinterpret_cast<const char*>(data.data()), data.size()}};
}

Result<LasReader> cloud_with(const TemporaryFolder& folder, const std::vector<LasVlr>& records) {
  const Bytes file = file_with_records(records, {}, {});
  test::write_file(folder / "a.las", {reinterpret_cast<const char*>(file.data()), file.size()});
  return LasReader::open(folder / "a.las");
}

TEST(CloudCrs, IsThatOfTheWktOrOfTheGeoTiffKeys) {
  const TemporaryFolder folder;
  const auto crs = [&](const std::vector<LasVlr>& records) { return *crs_wkt(*cloud_with(folder, records)); };
  EXPECT_EQ(crs({}), "");
  EXPECT_EQ(crs({geo_keys({1024, 1, 3072, 32767})}), "") << "a CRS of its own";
  EXPECT_EQ(crs({geo_keys({1024, 1, 3072, 60000})}), "") << "no such CRS";
  EXPECT_NE(crs({geo_keys({1024, 1, 3072, 32631})}).find("\"WGS 84 / UTM zone 31N\""), std::string::npos);
  EXPECT_EQ(crs({geo_keys({1024, 2, 2048, 4326})}).substr(0, 15), "GEOGCS[\"WGS 84\"");
  const std::string both = crs({geo_keys({1024, 1, 3072, 25832, 4096, 5783})});
  EXPECT_EQ(both.substr(0, 9), "COMPD_CS[");
  EXPECT_NE(both.find("VERT_CS[\"DHHN92 height\""), std::string::npos);
  EXPECT_EQ(crs({geo_keys({1024, 1, 3072, 25832, 4096, 5103})}), crs({geo_keys({1024, 1, 3072, 25832})}))
      << "a vertical datum of GeoTIFF 1.0, which EPSG has under another number";
  EXPECT_EQ(crs({{"LASF_Projection", 2112, "", "PROJCS[\"x\"]"}, geo_keys({1024, 1, 3072, 32631})}), "PROJCS[\"x\"]");
}

/// The record of doubles, and the keys that name its values: key, number, key, number ... in the order of the doubles.
std::vector<LasVlr> own_projection(std::vector<std::uint16_t> values,
                                   const std::vector<std::pair<int, double>>& doubles) {
  Bytes keys, numbers;
  for (const std::uint16_t value : std::array<std::uint16_t, 3>{1, 1, 0}) append(keys, value);
  append(keys, static_cast<std::uint16_t>(values.size() / 2 + doubles.size()));
  for (std::size_t i = 0; i < values.size(); i += 2)
    for (const std::uint16_t value : std::array<std::uint16_t, 4>{values[i], 0, 1, values[i + 1]}) append(keys, value);
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    for (const int value : {doubles[i].first, 34736, 1, static_cast<int>(i)})
      append(keys, static_cast<std::uint16_t>(value));
    append(numbers, doubles[i].second);
  }
  const auto record = [](std::uint16_t id, const Bytes& data) {
    return LasVlr{"LASF_Projection", id, "", {reinterpret_cast<const char*>(data.data()), data.size()}};
  };
  return {record(34735, keys), record(34736, numbers)};
}

TEST(CloudCrs, IsTheProjectionThatTheKeysDescribe) {
  const TemporaryFolder folder;
  const auto crs = [&](const std::vector<LasVlr>& records) { return *crs_wkt(*cloud_with(folder, records)); };
  // Oregon in international feet, with the false origin in feet.
  const std::vector<std::uint16_t> oregon{1024, 1,     2048, 32767, 2050, 6152, 2054, 9102,
                                          3072, 32767, 3075, 8,     3076, 9002, 4096, 5703};
  const std::string lambert = crs(own_projection(
      oregon, {{2061, 0}, {3078, 43}, {3079, 45.5}, {3084, -120.5}, {3085, 41.75}, {3086, 1312335.958}, {3087, 0}}));
  for (const char* part :
       {"COMPD_CS[", "PROJECTION[\"Lambert_Conformal_Conic_2SP\"]", "PARAMETER[\"standard_parallel_2\",45.5]",
        "PARAMETER[\"central_meridian\",-120.5]", "PARAMETER[\"false_easting\",1312335.958]",
        "DATUM[\"NAD83_High_Accuracy_Reference_Network\"", "UNIT[\"foot\",0.3048]", "VERT_CS[\"NAVD88 height\""})
    EXPECT_NE(lambert.find(part), std::string::npos) << part << " in " << lambert;
  // A datum without a name, on an ellipsoid of its own.
  const std::string mercator = crs(own_projection(
      {1024, 1, 2048, 32767, 2050, 32767, 3072, 32767, 3075, 1, 3076, 9001},
      {{2057, 6378388}, {2059, 297}, {3080, -81}, {3081, 0}, {3082, 500000}, {3083, 0}, {3092, 0.9996}}));
  for (const char* part : {"SPHEROID[\"unknown\",6378388,297]", "PARAMETER[\"scale_factor\",0.9996]",
                           "PARAMETER[\"false_easting\",500000]"})
    EXPECT_NE(mercator.find(part), std::string::npos) << part << " in " << mercator;

  const auto unknown = own_projection({1024, 1, 2048, 4326, 3072, 32767, 3075, 15}, {{3081, 90}});
  EXPECT_EQ(crs(unknown), "") << "polar stereographic";
  EXPECT_TRUE(*has_unread_crs(*cloud_with(folder, unknown)));
  EXPECT_FALSE(*has_unread_crs(*cloud_with(folder, {geo_keys({1024, 1, 3072, 32631})})));
  EXPECT_FALSE(*has_unread_crs(*cloud_with(folder, {})));
}

TEST(CloudCrs, IsThatOfLibLasAndOfGeocentricKeys) {
  const TemporaryFolder folder;
  const auto crs = [&](const std::vector<LasVlr>& records) { return *crs_wkt(*cloud_with(folder, records)); };
  const LasVlr of_liblas{"liblas", 2112, "", std::string("PROJCS[\"x\"]\0", 12)};
  EXPECT_EQ(crs({geo_keys({1024, 1, 3072, 32767}), of_liblas}), "PROJCS[\"x\"]");
  EXPECT_EQ(crs({of_liblas, {"LASF_Projection", 2112, "", "PROJCS[\"y\"]"}}), "PROJCS[\"y\"]");
  EXPECT_EQ(crs({geo_keys({1024, 3, 2048, 4326})}).substr(0, 6), "GEOCCS");
}

TEST(CloudCrs, KnowsTheUnit) {
  const TemporaryFolder folder;
  const auto unit = [&](const std::vector<LasVlr>& records) { return *crs_unit(*cloud_with(folder, records)); };
  const auto& keys = geo_keys;
  EXPECT_EQ(unit({}).metres, 1);
  EXPECT_EQ(unit({keys({1024, 1, 3072, 32631})}).metres, 1);
  EXPECT_NEAR(unit({keys({1024, 1, 3072, 2992})}).metres, 0.3048, 1e-12) << "Oregon, international feet";
  EXPECT_NEAR(unit({keys({1024, 1, 3076, 9003})}).metres, 1200.0 / 3937, 1e-12);
  EXPECT_TRUE(unit({keys({1024, 2, 2048, 4326})}).is_angle);
  const std::string wkt =
      R"(PROJCS["x",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
      R"(UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],)"
      R"(PARAMETER["central_meridian",0],PARAMETER["scale_factor",1],PARAMETER["false_easting",0],)"
      R"(PARAMETER["false_northing",0],UNIT["foot",0.3048]])";
  EXPECT_NEAR(unit({{"LASF_Projection", 2112, "", wkt}}).metres, 0.3048, 1e-12);
  EXPECT_NEAR(unit({{"LASF_Projection", 2112, "",
                     "COMPD_CS[\"c\"," + wkt + R"(,VERT_CS["h",VERT_DATUM["d",2005],UNIT["metre",1]]])"}})
                  .metres,
              0.3048, 1e-12);
}

TEST(LasReader, RefusesWhatItCannotRead) {
  const TemporaryFolder folder;
  test::write_file(folder / "text.las", "~Version ---- a well log, which is another kind of LAS");
  EXPECT_EQ(LasReader::open(folder / "text.las").error().code, ErrorCode::Malformed);
  write_cloud(folder / "cloud.las", {sample_cloud(3)});
  std::string bytes = test::contents(folder / "cloud.las");
  bytes[104] = static_cast<char>(7 | 0x80);
  test::write_file(folder / "laz.las", bytes);
  const auto laz = LasReader::open(folder / "laz.las");
  EXPECT_EQ(laz.error().code, ErrorCode::Malformed);
  EXPECT_NE(laz.error().message.find("LAZ"), std::string::npos);
  test::write_file(folder / "empty.las", "");
  EXPECT_NE(LasReader::open(folder / "empty.las").error().message.find("the file is empty"), std::string::npos);
  // A scale that makes no coordinates: pictures of them had no end.
  for (const double scale : {1e300, 0.0, std::numeric_limits<double>::quiet_NaN()}) {
    bytes = test::contents(folder / "cloud.las");
    std::memcpy(bytes.data() + 131, &scale, sizeof scale);
    test::write_file(folder / "scale.las", bytes);
    const auto scaled = LasReader::open(folder / "scale.las");
    ASSERT_FALSE(scaled) << scale;
    EXPECT_NE(scaled.error().message.find("make no coordinates"), std::string::npos);
  }
}

}  // namespace
}  // namespace hueline::storage
