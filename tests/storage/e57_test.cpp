// E57 files of others: each kind of number, packets that split values, poses, points without a place, damage.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "storage/cloud_file.hpp"
#include "storage/e57_reader.hpp"
#include "storage/scan_file.hpp"
#include "tests/storage/small_e57.hpp"

namespace hueline::storage {
namespace {

using test::SmallE57;

std::filesystem::path written_e57(const std::string& bytes) {
  const auto path = std::filesystem::path(testing::TempDir()) / "other.e57";
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::string scan_xml(std::uint64_t section, std::size_t points, const std::string& fields,
                     const std::string& more = "") {
  return "<vectorChild type=\"Structure\">" + more + "<points type=\"CompressedVector\" fileOffset=\"" +
         std::to_string(section) + "\" recordCount=\"" + std::to_string(points) + "\"><prototype type=\"Structure\">" +
         fields + "</prototype><codecs type=\"Vector\"/></points></vectorChild>";
}
std::string root_xml(const std::string& scans, const std::string& more = "") {
  return "<?xml version=\"1.0\"?>\n<!-- by hand --><e57Root type=\"Structure\">" + more + "<data3D type=\"Vector\">" +
         scans + "</data3D></e57Root>";
}
std::string pose_xml(double x, double y, double z, double w, double qz) {
  const auto number = [](const char* name, double value) {
    return "<" + std::string(name) + " type=\"Float\">" + std::to_string(value) + "</" + name + ">";
  };
  return "<pose type=\"Structure\"><rotation type=\"Structure\">" + number("w", w) + number("z", qz) +
         "</rotation><translation type=\"Structure\">" + number("x", x) + number("y", y) + number("z", z) +
         "</translation></pose>";
}

constexpr const char* kFloats =
    "<cartesianX type=\"Float\" precision=\"single\"/><cartesianY type=\"Float\"/>"
    "<cartesianZ type=\"ScaledInteger\" minimum=\"-1000\" maximum=\"1000\" scale=\"0.001\" offset=\"5\"/>";

/// A value of 11 bits that lies in two packets, colours, a field that is the same for all points and so has no bytes.
TEST(E57, ReadsEachKindOfNumber) {
  SmallE57 out;
  const std::string z = SmallE57::packed({0, 1000, 2000}, 11);
  const std::string x = SmallE57::numbers<float>({1.5f, -2, 3}), y = SmallE57::numbers<double>({10, 20.25, 30});
  const std::string red = SmallE57::packed({0, 255, 7}, 8);
  const std::uint64_t at =
      out.section({SmallE57::other_packet(0), SmallE57::packet({x.substr(0, 6), y, z.substr(0, 2), red, ""}),
                   SmallE57::other_packet(2), SmallE57::packet({x.substr(6), "", z.substr(2), "", ""})});
  const auto path = written_e57(
      out.file(root_xml(scan_xml(at, 3,
                                 std::string(kFloats) + "<colorRed type=\"Integer\" minimum=\"0\" maximum=\"255\"/>"
                                                        "<rowIndex type=\"Integer\" minimum=\"-3\" maximum=\"-3\"/>",
                                 "<name type=\"String\"><![CDATA[Hall <1>]]></name>"),
                        "<coordinateMetadata type=\"String\">PROJCS[&quot;a&#x20;map&quot;]</coordinateMetadata>")));
  const auto reader = E57Reader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->crs(), "PROJCS[\"a map\"]");
  EXPECT_EQ(reader->scans()[0].name, "Hall <1>");
  const auto cloud = read_cloud(path.string());
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->fields, (std::vector<std::string>{"x", "y", "z", "red", "row"}));
  const auto values = [&](const char* field) {
    const auto column = cloud->column(field);
    return std::vector<double>(column.begin(), column.end());
  };
  EXPECT_EQ(values("x"), (std::vector<double>{1.5, -2, 3}));
  EXPECT_EQ(values("y"), (std::vector<double>{10, 20.25, 30}));
  EXPECT_EQ(values("z"), (std::vector<double>{4, 5, 6}));
  EXPECT_EQ(values("red"), (std::vector<double>{0, 255, 7}));
  EXPECT_EQ(values("row"), (std::vector<double>{-3, -3, -3}));
  EXPECT_EQ(cloud->types[3].kind, 'U');
  EXPECT_EQ(cloud->types[3].size, 1u);
}

/// Entities that a file defines are not replaced, so a small file cannot become a large text, nor a name another file.
TEST(E57, ReadsTextsInPiecesAndNoEntitiesOfTheFile) {
  std::string xml =
      "<!DOCTYPE e57Root [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY file SYSTEM \"/etc/passwd\">]><e57Root>"
      "<coordinateMetadata>one <![CDATA[<two>]]> &amp; <![CDATA[]]]]><![CDATA[>]]></coordinateMetadata><data3D>"
      "<vectorChild><name>&a;&file;</name></vectorChild> by hand <vectorChild/></data3D></e57Root>";
  const auto read = decode_e57_description(xml, "a");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->crs, "one <two> & ]]>");
  ASSERT_EQ(read->scans.size(), 2u);
  EXPECT_EQ(read->scans[0].name, "&a;&file;");
}

TEST(E57, PlacesAreInTheScannersFrameAndPosesLeadToTheFile) {
  SmallE57 out;
  const double half = std::sqrt(0.5);
  const std::string states = SmallE57::packed({0, 2, 1}, 2);
  const std::uint64_t at = out.section(
      {SmallE57::packet({SmallE57::numbers<double>({2, 9, 9}), SmallE57::numbers<double>({std::acos(0.0), 0, 0}),
                         SmallE57::numbers<double>({std::asin(0.5), 0, 0}), states})});
  const std::string fields =
      "<sphericalRange type=\"Float\"/><sphericalAzimuth type=\"Float\"/><sphericalElevation type=\"Float\"/>"
      "<sphericalInvalidState type=\"Integer\" minimum=\"0\" maximum=\"2\"/>";
  const auto path = written_e57(out.file(root_xml(scan_xml(at, 3, fields, pose_xml(100, 200, 300, half, half)))));
  auto reader = E57Reader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  std::vector<std::vector<double>> columns;
  std::vector<Point<Scanner>> places;
  ASSERT_TRUE(reader->begin(0).ok());
  ASSERT_TRUE(reader->next(columns).ok());
  e57_places(reader->scans()[0], columns, places);
  ASSERT_EQ(places.size(), 3u);
  EXPECT_LT((places[0].xyz - Eigen::Vector3d(0, std::sqrt(3), 1)).norm(), 1e-12);
  EXPECT_TRUE(std::isnan(places[1].xyz.x()) && std::isnan(places[2].xyz.z()));
  // A quarter turn to the left brings y to -x.
  const Eigen::Vector3d in_file = (reader->scans()[0].T_world_scanner * places[0]).xyz;
  EXPECT_LT((in_file - Eigen::Vector3d(100 - std::sqrt(3), 200, 301)).norm(), 1e-5);  // the pose has 6 decimals
  const auto scan = ScanFile::open(path);
  ASSERT_TRUE(scan.ok()) << scan.error().message;
  EXPECT_EQ(scan->layout().points, 1u);
  std::vector<std::byte> scratch;
  const auto block = scan->block(0, scratch);
  ASSERT_TRUE(block.ok());
  ASSERT_EQ(block->size(), 3u);
  EXPECT_NEAR((*block)[1], std::sqrt(3), 1e-6);
  const auto moved = ScanFile::open(path, {}, {0, 1, -5'000'000});
  ASSERT_TRUE(moved.ok()) << moved.error().message;
  EXPECT_NEAR((*moved->block(0, scratch))[1], std::sqrt(3) - 1, 1e-6);
  EXPECT_EQ((*moved->block(0, scratch))[2], 5'000'001);
}

/// One scan has an intensity and the other has not; then scans from two places, which have no common frame.
TEST(E57, JoinsScansOfOnePoseOnly) {
  const auto two = [](const std::string& pose) {
    SmallE57 out;
    const std::string place = SmallE57::numbers<double>({1, 2});
    const std::uint64_t first = out.section(
        {SmallE57::packet({place, place, place, SmallE57::packed({3, 4}, 4), SmallE57::packed({0, 1}, 1)})});
    const std::uint64_t second = out.section({SmallE57::packet({place, place, place})});
    const std::string xyz = "<cartesianX type=\"Float\"/><cartesianY type=\"Float\"/><cartesianZ type=\"Float\"/>";
    return written_e57(
        out.file(root_xml(scan_xml(first, 2,
                                   xyz + "<intensity type=\"Integer\" minimum=\"10\" maximum=\"25\"/>"
                                         "<isIntensityInvalid type=\"Integer\" minimum=\"0\" maximum=\"1\"/>") +
                          scan_xml(second, 2, xyz, pose))));
  };
  const auto cloud = read_cloud(two("").string());
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->fields, (std::vector<std::string>{"x", "y", "z", "intensity"}));
  ASSERT_EQ(cloud->points(), 4u);
  EXPECT_EQ(cloud->columns[3][0], 13);
  for (const std::size_t row : {1, 2, 3}) EXPECT_TRUE(std::isnan(cloud->columns[3][row])) << row;
  EXPECT_EQ(cloud->types[3].kind, 'F');
  const auto apart = read_cloud(two(pose_xml(1, 0, 0, 1, 0)).string());
  ASSERT_FALSE(apart.ok());
  EXPECT_EQ(apart.error().code, ErrorCode::Unsupported);
  EXPECT_NE(apart.error().message.find("different places"), std::string::npos);
}

TEST(E57, TellsDamageAndReadsWhatIsBeforeIt) {
  const std::string many = SmallE57::numbers(std::vector<double>(500, 1.25));
  const auto bytes = [&](std::size_t counted) {
    SmallE57 out;
    std::vector<std::string> packets;
    for (int i = 0; i < 70; ++i) packets.push_back(SmallE57::packet({many}));
    const std::uint64_t at = out.section(packets);
    return out.file(root_xml(scan_xml(at, counted, "<cartesianX type=\"Float\"/>")));
  };
  const auto read = [](const std::string& file, std::size_t& points) {
    auto reader = E57Reader::open(written_e57(file));
    if (!reader.ok()) return Status(reader.error());
    std::vector<std::vector<double>> columns;
    Status done = reader->begin(0);
    for (points = 0; done.ok();) {
      done = reader->next(columns);
      if (columns.front().empty()) break;
      points += columns.front().size();
    }
    return done;
  };
  std::size_t points = 0;
  const std::string whole = bytes(35000);
  EXPECT_TRUE(read(whole, points).ok());
  EXPECT_EQ(points, 35000u);

  const Status short_one = read(bytes(35001), points);
  ASSERT_FALSE(short_one.ok());
  EXPECT_EQ(points, 35000u);
  EXPECT_NE(short_one.error().message.find("35000 of its 35001 points"), std::string::npos)
      << short_one.error().message;

  std::string damaged = whole;
  damaged[200 * 1024 + 9] = static_cast<char>(damaged[200 * 1024 + 9] ^ 1);
  const Status found = read(damaged, points);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(points, 25000u);  // 50 packets of 4008 bytes are before page 200
  EXPECT_NE(found.error().message.find("byte 204800"), std::string::npos) << found.error().message;

  EXPECT_EQ(read(whole.substr(0, whole.size() - 1024), points).error().code, ErrorCode::Truncated);
  std::string open = whole;
  open.replace(24, 16, std::string(16, '\0'));
  EXPECT_NE(read(open, points).error().message.find("did not finish"), std::string::npos);
}

/// The first field's values are all in front of the second's: nothing of them is a point, whatever the file's size.
TEST(E57, HoldsNoMoreThanItSaysOfStreamsThatAreOutOfStep) {
  const std::string many = SmallE57::numbers(std::vector<double>(8000, 1.25));
  const auto first_block = [&](int ahead) {
    SmallE57 out;
    std::vector<std::string> packets(static_cast<std::size_t>(ahead), SmallE57::packet({many, ""}));
    packets.push_back(SmallE57::packet({"", many}));
    const std::uint64_t at = out.section(packets);
    auto reader = E57Reader::open(written_e57(
        out.file(root_xml(scan_xml(at, 8000, "<cartesianX type=\"Float\"/><cartesianY type=\"Float\"/>")))));
    EXPECT_TRUE(reader.ok() && reader->begin(0).ok());
    std::vector<std::vector<double>> columns;
    const Status read = reader->next(columns);
    return read.ok() ? std::to_string(columns[1].size()) : read.error().message;
  };
  EXPECT_EQ(first_block(262), "8000");
  EXPECT_NE(first_block(263).find("cartesianX is more than 16 MB ahead"), std::string::npos);
}

TEST(E57, SaysWhatIsWrongWithTheLengthOfAPacket) {
  const auto why = [](std::size_t length) {
    SmallE57 out;
    std::string packet = SmallE57::packet({SmallE57::numbers<double>({1})});
    packet[2] = static_cast<char>(length - 1);
    const std::uint64_t at = out.section({packet});
    const auto cloud =
        read_cloud(written_e57(out.file(root_xml(scan_xml(at, 1, "<cartesianX type=\"Float\"/>")))).string());
    return cloud.ok() ? std::string() : cloud.error().message;
  };
  EXPECT_EQ(why(16), "");
  EXPECT_NE(why(15).find("a packet of 15 bytes at byte 80, and lengths of packets are multiples of 4"),
            std::string::npos)
      << why(15);
  EXPECT_NE(why(64).find("a packet of 64 bytes at byte 80, and its section ends before it"), std::string::npos)
      << why(64);
}

TEST(E57, RefusesWhatIsNoCloud) {
  const auto why = [](const std::string& xml) {
    SmallE57 out;
    const std::uint64_t at = out.section({SmallE57::packet({SmallE57::numbers<double>({1})})});
    std::string text = xml;
    if (const std::size_t mark = text.find('@'); mark != std::string::npos) text.replace(mark, 1, std::to_string(at));
    const auto cloud = read_cloud(written_e57(out.file(text)).string());
    return cloud.ok() ? std::string() : cloud.error().message;
  };
  const auto points = [](const std::string& fields) {
    return root_xml("<vectorChild><points fileOffset=\"@\" recordCount=\"1\"><prototype>" + fields +
                    "</prototype></points></vectorChild>");
  };
  EXPECT_EQ(why(points("<cartesianX type=\"Float\"/>")), "");
  EXPECT_NE(why("<e57Root><data3D/></e57Root>").find("no points"), std::string::npos);
  EXPECT_NE(why("<e57Root><data3D></e57Root>").find("at byte 19 its description is no XML"), std::string::npos);
  EXPECT_NE(why(points("<label type=\"String\"/>")).find("label is of type String"), std::string::npos);
  EXPECT_NE(why(points("<cartesianX type=\"Integer\" minimum=\"1\" maximum=\"1\"/>")).find("no field that varies"),
            std::string::npos);
  EXPECT_NE(why(points("<cartesianX type=\"Float\"/><cartesianY type=\"Float\"/>")).find("streams are not those"),
            std::string::npos);
  std::string many;
  for (int i = 0; i < 4097; ++i) many += "<a" + std::to_string(i) + " type=\"Float\"/>";
  EXPECT_NE(why(points(many)).find("4097 fields; at most 4096"), std::string::npos);
  EXPECT_NE(why(root_xml("<vectorChild><pose><translation><x>1,5</x></translation></pose></vectorChild>"))
                .find("scan 0: its pose"),
            std::string::npos);
  const auto nested = [](int depth) {
    std::string open, closed;
    for (int i = 0; i < depth; ++i) open += "<a>", closed += "</a>";
    return open + closed;
  };
  EXPECT_NE(why(nested(64)).find("no points"), std::string::npos);
  EXPECT_NE(why(nested(65)).find("nested more than 64 deep"), std::string::npos);
}

}  // namespace
}  // namespace hueline::storage
