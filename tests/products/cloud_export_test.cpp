#include "products/cloud_export.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "products/cloud_split.hpp"
#include "storage/e57_reader.hpp"
#include "storage/las_reader.hpp"
#include "storage/las_writer.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::products {
namespace {

using storage::LasPoint;
using storage::LasReader;
using storage::LasWriter;
using test::TemporaryFolder;

void write_cloud(const std::filesystem::path& path, std::size_t points, bool compress = false) {
  LasWriter::Config config;
  config.format = compress ? storage::CloudFormat::Laz : storage::CloudFormat::Las;
  auto writer = LasWriter::create(path, test::sample_origin(), config);
  ASSERT_TRUE(writer && writer->append(test::sample_cloud(points)) && writer->close());
}

std::vector<std::string> records_of(const std::filesystem::path& path) {
  std::vector<std::string> out;
  auto reader = LasReader::open(path);
  EXPECT_TRUE(reader) << reader.error().message;
  for (std::vector<LasPoint> points; reader && reader->next(points, 7000) && !points.empty();)
    for (const LasPoint& p : points) out.emplace_back(reinterpret_cast<const char*>(p.record.data()), p.record.size());
  return out;
}

std::string contents(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ExportLaz, AndCopcHaveTheBoundsOfTheirPointsWhateverTheCloudSays) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 1000);
  const auto right = LasReader::open(folder / "cloud.las")->header();
  {  // max x and min x stand at byte 179 of the header
    std::fstream file(folder / "cloud.las", std::ios::binary | std::ios::in | std::ios::out);
    const double wrong[] = {right.minimum[0] + 0.001, right.maximum[0] + 500};
    file.seekp(179);
    file.write(reinterpret_cast<const char*>(wrong), sizeof wrong);
    ASSERT_TRUE(file.good());
  }
  ASSERT_NE(LasReader::open(folder / "cloud.las")->header().minimum, right.minimum);
  ASSERT_TRUE(export_laz(folder / "cloud.las", folder / "out.laz", {}));
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "out.copc.laz", {}));
  for (const char* name : {"out.laz", "out.copc.laz"}) {
    const auto header = LasReader::open(folder / name)->header();
    EXPECT_EQ(header.minimum, right.minimum) << name;
    EXPECT_EQ(header.maximum, right.maximum) << name;
    EXPECT_EQ(header.point_count, 1000u) << name;
    EXPECT_EQ(header.points_by_return, right.points_by_return) << name;
  }
}

TEST(ExportLaz, HasTheSameRecordsAndSaysTheSame) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 60'000);
  const auto done = export_laz(folder / "cloud.las", folder / "out.laz", {});
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->points, 60'000u);
  EXPECT_EQ(done->bytes, std::filesystem::file_size(folder / "out.laz"));
  EXPECT_TRUE(records_of(folder / "out.laz") == records_of(folder / "cloud.las"));
  auto from = LasReader::open(folder / "cloud.las"), to = LasReader::open(folder / "out.laz");
  EXPECT_EQ(to->wkt(), from->wkt());
  EXPECT_EQ(to->header().points_by_return, from->header().points_by_return);
  EXPECT_EQ(to->header().minimum, from->header().minimum);
  EXPECT_EQ(to->extra_fields().size(), from->extra_fields().size());

  CloudExport one;
  one.threads = 1;
  ASSERT_TRUE(export_laz(folder / "cloud.las", folder / "one.laz", one));
  EXPECT_TRUE(contents(folder / "one.laz") == contents(folder / "out.laz"));
  ASSERT_TRUE(export_laz(folder / "out.laz", folder / "again.laz", one));
  EXPECT_TRUE(contents(folder / "again.laz") == contents(folder / "out.laz")) << "LAZ made from LAZ";
}

/// Writes a LAS file of point format 3 with two extra bytes, as programs write that do not know LAS 1.4's formats.
void write_old_cloud(const std::filesystem::path& path, std::size_t points) {
  storage::LasHeader header;
  header.header_size = header.point_offset = storage::kLasHeaderSize14;
  header.point_format = 3;
  header.point_size = 36;
  header.scale = {0.01, 0.01, 0.01};
  header.point_count = header.points_by_return[0] = points;
  storage::Bytes bytes = storage::encode_las_header(header);
  for (std::size_t i = 0; i < points; ++i) {
    storage::Bytes record(36);
    storage::put(record, 0, static_cast<std::int32_t>(i * 7 % 1000));
    storage::put(record, 4, static_cast<std::int32_t>(i));
    storage::put(record, 14, std::uint8_t{9});
    storage::put(record, 20, 2e8 + static_cast<double>(i) * 1e-4);
    storage::put(record, 28, static_cast<std::uint16_t>(i));
    storage::put(record, 35, static_cast<std::uint8_t>(i % 11));
    storage::append(bytes, record);
  }
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

TEST(ExportLaz, KeepsAnOlderPointFormat) {
  const TemporaryFolder folder;
  write_old_cloud(folder / "cloud.las", 120'001);  // the last chunk has one point more than two full ones and 20 000
  ASSERT_TRUE(export_laz(folder / "cloud.las", folder / "out.laz", {}));
  const std::vector<std::string> wanted = records_of(folder / "cloud.las");
  ASSERT_EQ(wanted.size(), 120'001u);
  EXPECT_TRUE(records_of(folder / "out.laz") == wanted);
  const auto reader = LasReader::open(folder / "out.laz");
  EXPECT_EQ(reader->header().point_format, 3);
  EXPECT_EQ(reader->header().points_by_return[0], 120'001u);
  const std::string file = contents(folder / "out.laz");
  std::uint32_t old_count = 0;
  std::memcpy(&old_count, &file[107], sizeof old_count);
  EXPECT_EQ(old_count, 120'001u) << "programs that know LAS 1.2 only look here";
}

TEST(ExportCopc, GivesOlderPointsAFormatThatItHas) {
  const TemporaryFolder folder;
  write_old_cloud(folder / "cloud.las", 5000);
  std::string bytes = contents(folder / "cloud.las");
  const auto set = [&](std::size_t point, std::size_t at, int value) {
    bytes[storage::kLasHeaderSize14 + point * 36 + at] = static_cast<char>(value);
  };
  set(7, 14, 2 | 3 << 3 | 0x80);  // the second return of three, at the edge of a line
  set(7, 15, 12 | 0x80);          // overlap, withheld
  set(7, 16, -90);
  set(7, 17, 5);
  set(7, 18, 44);
  std::ofstream(folder / "cloud.las", std::ios::binary) << bytes;
  const auto done = export_copc(folder / "cloud.las", folder / "out.copc.laz", {});
  ASSERT_TRUE(done) << done.error().message;
  const auto points_of = [&](const char* name) {
    std::map<double, std::pair<LasPoint, std::string>> out;  // by time
    auto reader = LasReader::open(folder / name);
    std::vector<LasPoint> points;
    while (reader->next(points) && !points.empty())
      for (const LasPoint& p : points)
        out[*p.time] = {p, {reinterpret_cast<const char*>(p.record.data()), p.record.size()}};
    return out;
  };
  const auto before = points_of("cloud.las"), after = points_of("out.copc.laz");
  ASSERT_EQ(after.size(), 5000u);
  for (const auto& [time, one] : before) {
    const auto& [from, record] = one;
    const LasPoint& to = after.at(time).first;
    EXPECT_EQ(to.x, from.x);
    EXPECT_EQ(to.y, from.y);
    EXPECT_EQ(to.z, from.z);
    EXPECT_EQ(to.intensity, from.intensity);
    EXPECT_EQ(to.return_number, from.return_number);
    EXPECT_EQ(to.return_count, from.return_count);
    EXPECT_EQ(to.user_data, from.user_data);
    EXPECT_EQ(to.source, from.source);
    EXPECT_NEAR(to.scan_angle_deg, from.scan_angle_deg, 0.003);
    EXPECT_EQ(to.red, from.red);
    EXPECT_EQ(to.classification, from.classification == 12 ? 1 : from.classification);
    EXPECT_EQ(after.at(time).second.substr(36), record.substr(34)) << "the extra bytes";
  }
  const std::string& seventh = after.at(2e8 + 7e-4).second;
  EXPECT_EQ(static_cast<std::uint8_t>(seventh[15]), 0x80 | 8 | 4) << "edge of the line; overlap; withheld";

  bytes[104] = 4;
  bytes[105] = 57;
  std::ofstream(folder / "waves.las", std::ios::binary) << bytes;
  EXPECT_EQ(export_copc(folder / "waves.las", folder / "waves.copc.laz", {}).error().code, ErrorCode::Invalid);
  EXPECT_FALSE(std::filesystem::exists(folder / "waves.copc.laz"));
}

TEST(ExportLaz, AnOlderPointFormatIsReadWithoutItsTable) {
  const TemporaryFolder folder;
  write_old_cloud(folder / "cloud.las", 120'001);
  ASSERT_TRUE(export_laz(folder / "cloud.las", folder / "out.laz", {}));
  const std::vector<std::string> wanted = records_of(folder / "cloud.las");
  const std::string whole = contents(folder / "out.laz");
  const auto place_at = LasReader::open(folder / "out.laz")->header().point_offset;
  // A program that writes into a pipe puts the place of the table behind it.
  std::string piped = whole + whole.substr(place_at, 8);
  std::fill_n(piped.begin() + place_at, 8, '\xFF');
  std::ofstream(folder / "piped.laz", std::ios::binary) << piped;
  EXPECT_TRUE(records_of(folder / "piped.laz") == wanted);
  // A file that was cut has its whole chunks.
  std::ofstream(folder / "cut.laz", std::ios::binary) << whole.substr(0, whole.size() * 6 / 10);
  const std::vector<std::string> some = records_of(folder / "cut.laz");
  ASSERT_EQ(some.size(), 50'000u);
  EXPECT_TRUE(std::equal(some.begin(), some.end(), wanted.begin()));
}

TEST(ExportLaz, WritesWhatIsWholeOfACutCloud) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 1000);
  std::filesystem::resize_file(folder / "cloud.las", std::filesystem::file_size(folder / "cloud.las") - 58 * 100 - 1);
  const auto done = export_laz(folder / "cloud.las", folder / "out.laz", {});
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_TRUE(done->source_was_cut);
  EXPECT_EQ(done->points, 899u);
  EXPECT_EQ(records_of(folder / "out.laz").size(), 899u);
}

/// Returns the first and the last GPS time that the info record of a COPC file states.
std::pair<double, double> times_in_info(const std::filesystem::path& path) {
  const std::string bytes = contents(path);
  constexpr std::size_t kFirst = 375 + 54 + 56;  // the header, the head of the record, eight numbers less one
  std::pair<double, double> out;
  std::memcpy(&out.first, &bytes[kFirst], sizeof out.first);
  std::memcpy(&out.second, &bytes[kFirst + 8], sizeof out.second);
  return out;
}

TEST(ExportCopc, StatesTimesThatAreNumbers) {
  const TemporaryFolder folder;
  write_old_cloud(folder / "cloud.las", 100);
  const auto set_times = [&](std::size_t first, std::size_t end) {
    std::string bytes = contents(folder / "cloud.las");
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = first; i < end; ++i) std::memcpy(&bytes[storage::kLasHeaderSize14 + i * 36 + 20], &none, 8);
    std::ofstream(folder / "cloud.las", std::ios::binary) << bytes;
  };
  set_times(0, 10);
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "some.copc.laz", {}));
  EXPECT_NEAR(times_in_info(folder / "some.copc.laz").first, 2e8 + 0.001, 1e-6);
  EXPECT_NEAR(times_in_info(folder / "some.copc.laz").second, 2e8 + 0.0099, 1e-6);
  set_times(10, 100);
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "none.copc.laz", {}));
  EXPECT_EQ(times_in_info(folder / "none.copc.laz"), (std::pair<double, double>{0, 0}));
}

/// Programs of before LAS 1.4 left WKT in a record of libLAS, where readers of COPC do not look.
TEST(ExportCopc, HasTheCrsWhereItsReadersLookForIt) {
  const TemporaryFolder folder;
  write_old_cloud(folder / "cloud.las", 100);
  std::string bytes = contents(folder / "cloud.las");
  storage::Bytes record;
  storage::append_vlr(record, {"liblas", 2112, "", std::string("LOCAL_CS[\"a site\"]\0", 19)});
  bytes.insert(storage::kLasHeaderSize14, reinterpret_cast<const char*>(record.data()), record.size());
  const auto offset = static_cast<std::uint32_t>(storage::kLasHeaderSize14 + record.size()), one = std::uint32_t{1};
  std::memcpy(&bytes[96], &offset, sizeof offset);
  std::memcpy(&bytes[100], &one, sizeof one);
  std::ofstream(folder / "cloud.las", std::ios::binary) << bytes;
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "out.copc.laz", {}));
  const auto reader = LasReader::open(folder / "out.copc.laz");
  ASSERT_TRUE(reader) << reader.error().message;
  const auto found = std::ranges::find_if(reader->records(), [](const storage::LasVlr& r) {
    return r.user_id == "LASF_Projection" && r.record_id == 2112;
  });
  ASSERT_NE(found, reader->records().end());
  EXPECT_EQ(found->data, std::string("LOCAL_CS[\"a site\"]\0", 19));
}

TEST(ExportCopc, HasEveryRecordOnceWhateverTheMemoryAndTheThreads) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", 30'000);
  CloudExport options;
  options.node_points = 500;
  const auto done = export_copc(folder / "cloud.las", folder / "out.copc.laz", options);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_GT(done->nodes, 60u);
  std::vector<std::string> wanted = records_of(folder / "cloud.las"), found = records_of(folder / "out.copc.laz");
  EXPECT_FALSE(found == wanted) << "the nodes have another order than the drive";
  std::sort(wanted.begin(), wanted.end());
  std::sort(found.begin(), found.end());
  EXPECT_TRUE(found == wanted);

  options.threads = 3;
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "other.copc.laz", options));
  EXPECT_TRUE(contents(folder / "other.copc.laz") == contents(folder / "out.copc.laz"));
  write_cloud(folder / "cloud.laz", 30'000, true);
  ASSERT_TRUE(export_copc(folder / "cloud.laz", folder / "from_laz.copc.laz", options));
  EXPECT_TRUE(records_of(folder / "from_laz.copc.laz") == records_of(folder / "out.copc.laz"));

  options.held_bytes = 4000 * 58;
  ASSERT_TRUE(export_copc(folder / "cloud.las", folder / "other.copc.laz", options));
  found = records_of(folder / "other.copc.laz");
  std::sort(found.begin(), found.end());
  EXPECT_TRUE(found == wanted);
}

TEST(ExportCopc, TakesPointsThatAllHaveOnePlace) {
  const TemporaryFolder folder;
  CloudBlock cloud = test::sample_cloud(3000);
  for (ColouredPoint& p : cloud.points) p.east = p.north = p.up = 1;
  auto writer = LasWriter::create(folder / "cloud.las", test::sample_origin(), {});
  ASSERT_TRUE(writer->append(cloud) && writer->close());
  CloudExport options;
  options.node_points = 100;
  const auto done = export_copc(folder / "cloud.las", folder / "out.copc.laz", options);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(records_of(folder / "out.copc.laz").size(), 3000u);
}

/// Writes another CRS into a cloud of ours, in the room of the one that is there.
void change_crs(const std::filesystem::path& path, std::string wkt) {
  std::string bytes = contents(path);
  const std::size_t at = bytes.find("COMPD_CS[");
  ASSERT_NE(at, std::string::npos);
  const auto size =
      static_cast<unsigned char>(bytes[at - 34]) + std::size_t{256} * static_cast<unsigned char>(bytes[at - 33]);
  ASSERT_LE(wkt.size(), size);
  wkt.resize(size, '\0');
  bytes.replace(at, size, wkt);
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Other programs' readers look for a packet of data behind the head of the section, and take an index there for
/// damage.
TEST(ExportE57, HasAPacketOfDataEvenWithoutPoints) {
  const TemporaryFolder folder;
  for (const std::size_t points : {0, 70}) {
    write_old_cloud(folder / "cloud.las", points);
    ASSERT_TRUE(export_e57(folder / "cloud.las", folder / "out.e57", "a program"));
    EXPECT_EQ(contents(folder / "out.e57")[80], '\1') << points;
    auto reader = storage::E57Reader::open(folder / "out.e57");
    ASSERT_TRUE(reader) << reader.error().message;
    ASSERT_EQ(reader->scans().size(), 1u);
    EXPECT_EQ(reader->scans()[0].points, points);
    std::vector<std::vector<double>> columns;
    ASSERT_TRUE(reader->begin(0) && reader->next(columns));
    std::vector<Point<Scanner>> places;
    storage::e57_places(reader->scans()[0], columns, places);
    ASSERT_EQ(places.size(), points);
    for (std::size_t i = 0; i < points; ++i)
      EXPECT_EQ(places[i].xyz,
                Eigen::Vector3d(static_cast<double>(i * 7 % 1000) * 0.01, static_cast<double>(i) * 0.01, 0));
  }
}

/// What is in an E57 file whose points fit into one packet.
struct SmallE57 {
  explicit SmallE57(const std::filesystem::path& path) {
    const std::string file = contents(path);
    std::string bytes;  // without the checksums of the pages
    for (std::size_t at = 0; at < file.size(); at += 1024) bytes += file.substr(at, 1020);
    xml = bytes.substr(bytes.find("<?xml"));
    std::uint16_t streams = 0;
    std::memcpy(&streams, bytes.data() + 80 + 4, 2);
    std::size_t at = 80 + 6 + std::size_t{2} * streams;
    for (std::size_t i = 0; i < streams; ++i) {
      std::uint16_t size = 0;
      std::memcpy(&size, bytes.data() + 80 + 6 + 2 * i, 2);
      if (i < 3 || i + 1 == streams) {
        std::vector<double>& out = i < 3 ? place[i] : times;
        out.resize(size / sizeof(double));
        std::memcpy(out.data(), bytes.data() + at, size);
      }
      at += size;
    }
  }
  /// The number in the first element of that name behind `after`.
  double number(const std::string& name, const std::string& after = "<e57Root") const {
    const std::size_t at = xml.find("<" + name + " ", xml.find(after));
    return at == std::string::npos ? -1 : std::stod(xml.substr(xml.find('>', at) + 1));
  }
  std::string xml;
  std::vector<double> place[3], times;
};

constexpr const char* kGeographic =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";

/// The beginning of a compound CRS: a map in feet.
std::string map_in_feet() {
  return std::string(R"(COMPD_CS["both",PROJCS["map in feet",)") + kGeographic +
         R"(,PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],PARAMETER["scale_factor",1],PARAMETER["false_easting",3937],PARAMETER["false_northing",0],UNIT["US survey foot",0.304800609601219]],)";
}

TEST(ExportE57, KeepsHeightsAboveTheEllipsoidOfAMapInFeet) {
  const TemporaryFolder folder;
  write_cloud(folder / "feet.las", 40);
  change_crs(folder / "feet.las",
             map_in_feet() +
                 R"wkt(VERT_CS["Ellipsoid (metre)",VERT_DATUM["Ellipsoid",2002],UNIT["metre",1],AXIS["Up",UP]]])wkt");
  const auto done = export_e57(folder / "feet.las", folder / "feet.e57", "a program");
  ASSERT_TRUE(done) << done.error().message;
  const SmallE57 e57(folder / "feet.e57");
  std::vector<LasPoint> points;
  ASSERT_TRUE(LasReader::open(folder / "feet.las")->next(points));
  ASSERT_EQ(points.size(), 40u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(e57.place[0][i], points[i].x * 1200 / 3937, 1e-6);
    EXPECT_NEAR(e57.place[2][i], points[i].z, 1e-9);
  }
  EXPECT_NE(e57.xml.find("&quot;false_easting&quot;,1200]"), std::string::npos) << e57.xml;
  EXPECT_NE(e57.xml.find("VERT_DATUM[&quot;Ellipsoid&quot;,2002"), std::string::npos) << e57.xml;
  EXPECT_EQ(e57.xml.find("foot"), std::string::npos) << e57.xml;
}

TEST(ExportE57, CountsInMetresAndFromTheEarliestPoint) {
  const TemporaryFolder folder;
  write_cloud(folder / "feet.las", 40);
  change_crs(folder / "feet.las",
             map_in_feet() + R"(VERT_CS["heights",VERT_DATUM["a datum",2005],UNIT["foot",0.3048]]])");
  // The first point is the latest, as in the order of an octree.
  std::string bytes = contents(folder / "feet.las");
  std::uint32_t first = 0;
  std::memcpy(&first, bytes.data() + 96, 4);
  double time = 0;
  std::memcpy(&time, bytes.data() + first + 22, 8);
  time += 20;
  std::memcpy(bytes.data() + first + 22, &time, 8);
  std::ofstream(folder / "feet.las", std::ios::binary) << bytes;

  auto done = export_e57(folder / "feet.las", folder / "feet.e57", "a program");
  ASSERT_TRUE(done) << done.error().message;
  const SmallE57 e57(folder / "feet.e57");
  std::vector<LasPoint> points;
  ASSERT_TRUE(LasReader::open(folder / "feet.las")->next(points));
  ASSERT_EQ(points.size(), 40u);
  ASSERT_EQ(e57.times.size(), 40u);
  double earliest = time;
  for (const LasPoint& p : points) earliest = std::min(earliest, *p.time);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(e57.place[0][i], points[i].x * 1200 / 3937, 1e-6);
    EXPECT_NEAR(e57.place[1][i], points[i].y * 1200 / 3937, 1e-6);
    EXPECT_NEAR(e57.place[2][i], points[i].z * 0.3048, 1e-9);
    EXPECT_NEAR(e57.times[i], *points[i].time - earliest, 1e-9);
    EXPECT_GE(e57.times[i], 0);
  }
  EXPECT_NEAR(e57.number("xMinimum"), *std::min_element(e57.place[0].begin(), e57.place[0].end()), 1e-9);
  EXPECT_NEAR(e57.number("dateTimeValue", "<acquisitionStart"), earliest + 1e9, 1e-6);
  EXPECT_NEAR(e57.number("dateTimeValue", "<acquisitionEnd"), time + 1e9, 1e-6);
  EXPECT_NE(e57.xml.find("UNIT[&quot;metre&quot;,1"), std::string::npos) << e57.xml;
  EXPECT_NE(e57.xml.find("&quot;false_easting&quot;,1200]"), std::string::npos) << e57.xml;
  EXPECT_EQ(e57.xml.find("foot"), std::string::npos) << e57.xml;

  write_cloud(folder / "degrees.las", 40);
  change_crs(folder / "degrees.las", kGeographic);
  EXPECT_EQ(export_e57(folder / "degrees.las", folder / "degrees.e57", "").error().code, ErrorCode::Invalid);
  EXPECT_FALSE(std::filesystem::exists(folder / "degrees.e57"));
}

TEST(ExportE57, IsReadableWhateverTheCloudIsCalled) {
  const TemporaryFolder folder;
  write_cloud(folder / "M\xfcnchen.las", 10);
  ASSERT_TRUE(export_e57(folder / "M\xfcnchen.las", folder / "out.e57", "a program"));
  EXPECT_NE(SmallE57(folder / "out.e57").xml.find("M\\xfcnchen"), std::string::npos);
}

TEST(Export, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(export_laz(folder / "none.las", folder / "out.laz", {}).error().code, ErrorCode::Unavailable);
  write_cloud(folder / "empty.las", 0);
  EXPECT_EQ(export_copc(folder / "empty.las", folder / "out.laz", {}).error().code, ErrorCode::EndOfData);
  EXPECT_EQ(split_cloud(folder / "empty.las", folder.path(), {}, {}, false, {}).error().code, ErrorCode::EndOfData);
  write_cloud(folder / "cut.las", 10);
  std::filesystem::resize_file(folder / "cut.las", std::filesystem::file_size(folder / "cut.las") - 9 * 58 - 1);
  EXPECT_EQ(export_copc(folder / "cut.las", folder / "cut.copc.laz", {}).error().code, ErrorCode::Truncated);
  EXPECT_FALSE(std::filesystem::exists(folder / "cut.copc.laz")) << "nothing is written of a cloud without a point";
  write_cloud(folder / "cloud.las", 10);
  EXPECT_EQ(export_laz(folder / "cloud.las", "/nonexistent/out.laz", {}).error().code, ErrorCode::Io);
  std::string bytes = contents(folder / "cloud.las");
  bytes[104] = 4;
  std::ofstream(folder / "old.las", std::ios::binary) << bytes;
  EXPECT_EQ(export_laz(folder / "old.las", folder / "out.laz", {}).error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::products
