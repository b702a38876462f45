// What `hueline inspect` says of clouds and accuracies that other programs wrote.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "apps/inspect/inspect.hpp"
#include "tests/storage/small_e57.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using test::SmallE57;
using test::TemporaryFolder;

TEST(InspectFiles, PlacesOfE57AreThoseOfTheFile) {
  SmallE57 out;
  const std::uint64_t at =
      out.section({SmallE57::packet({SmallE57::numbers<double>({1, 2, 0}), SmallE57::numbers<double>({5, 5, 0}),
                                     SmallE57::numbers<double>({0, 1, 0}), SmallE57::packed({0, 0, 2}, 2)})});
  const TemporaryFolder folder;
  test::write_file(
      folder / "hall.e57",
      out.file("<e57Root><data3D><vectorChild><name>north</name><sensorModel>P20</sensorModel>"
               "<acquisitionStart><dateTimeValue>1000000000</dateTimeValue></acquisitionStart>"
               "<pose><rotation><w>0</w><x>0</x><y>0</y><z>1</z></rotation>"
               "<translation><x>100</x><y>200</y><z>300</z></translation></pose><points fileOffset=\"" +
               std::to_string(at) +
               "\" recordCount=\"3\"><prototype><cartesianX type=\"Float\"/><cartesianY type=\"Float\"/>"
               "<cartesianZ type=\"Float\"/><cartesianInvalidState type=\"Integer\" minimum=\"0\" maximum=\"2\"/>"
               "</prototype></points></vectorChild></data3D><images2D><vectorChild/></images2D>"
               "<coordinateMetadata>a site</coordinateMetadata></e57Root>"));
  const auto seen = apps::inspect_file((folder / "hall.e57").string());
  ASSERT_TRUE(seen.found) << seen.trouble.error().message;
  EXPECT_TRUE(seen.trouble.ok());
  EXPECT_EQ(seen.found->at("format"), "E57");
  EXPECT_EQ(seen.found->at("points"), 3);
  EXPECT_EQ(seen.found->at("points_without_place"), 1);
  EXPECT_EQ(seen.found->at("x"), (std::vector<double>{98, 99}));
  EXPECT_EQ(seen.found->at("y"), (std::vector<double>{195, 195}));
  EXPECT_EQ(seen.found->at("z"), (std::vector<double>{300, 301}));
  EXPECT_EQ(seen.found->at("images"), 1);
  EXPECT_EQ(seen.found->at("crs"), "a site");
  const auto& scan = seen.found->at("scans").at(0);
  EXPECT_EQ(scan.at("name"), "north");
  EXPECT_EQ(scan.at("sensor"), "P20");
  EXPECT_EQ(scan.at("begin"), "2011-09-14T01:46:25.000Z");
  EXPECT_EQ(scan.at("turn_deg"), 180.0);
}

TEST(InspectFiles, TextIsACloudOnlyWhereItSaysSo) {
  const TemporaryFolder folder;
  const auto format = [&](const char* name, const std::string& text) {
    test::write_file(folder / name, text);
    const auto seen = apps::inspect_file((folder / name).string());
    return seen.found ? seen.found->at("format").get<std::string>() : std::string();
  };
  EXPECT_EQ(format("a.pts", "1\n1 2 3 4\n"), "PTS");
  EXPECT_EQ(format("a.XYZ", "1 2 3\n"), "text with x y z");
  EXPECT_EQ(format("a.asc", "1 2 3\n4 5 6\n"), "text with x y z") << "logs of a CAN bus have this ending, too";
  EXPECT_EQ(format("scan", "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n7 0 0 1\n1 2 3 0.5\n"), "PTX");
  EXPECT_EQ(format("tum.txt", "1305031098.6 1 2 3 0 0 0 1\n"), "") << "a trajectory";
  EXPECT_EQ(format("notes", "1 2 3\n"), "");
  const auto seen = apps::inspect_file((folder / "scan").string());
  EXPECT_EQ(seen.found->at("fields").at("x"), (std::vector<double>{8, 8})) << "of the file";
}

TEST(InspectFiles, SaysWhatAFileIsThatIsNotRead) {
  using namespace std::string_literals;
  const TemporaryFolder folder;
  const auto trouble = [&](const char* name, const std::string& content) {
    test::write_file(folder / name, content);
    const auto seen = apps::inspect_file((folder / name).string());
    EXPECT_FALSE(seen.found) << name;
    return seen.trouble.ok() ? std::string() : seen.trouble.error().message;
  };
  const auto has = [](const char* words) { return testing::HasSubstr(words); };
  EXPECT_THAT(trouble("dem.asc", "ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n"),
              has("dem.asc is a grid of heights or other values (Esri ASCII grid) and has no points"));
  EXPECT_THAT(trouble("dsm.asc", "NCOLS         2\r\nNROWS 1\r\n"), has("Esri ASCII grid"));
  EXPECT_THAT(trouble("car.trc", "@ TEXT @ 3 @ 64 @ 0 @ 1 @ 1 @ 00:00:00.001 @\r0,641405\t1\t0004\t112\t1\t00\r"),
              has("is a trace of CARBUS Analyzer, which is not read: open it in SavvyCAN"));
  EXPECT_THAT(trouble("a.jpg", "\xFF\xD8\xFF\xE1 Exif"), has("a.jpg is an image: `hueline colour` takes it"));
  EXPECT_THAT(trouble("a.png", "\x89PNG\r\n\x1A\n"), has("is an image: "));
  EXPECT_THAT(trouble("a.tif", "II*\0\x08\0\0\0"s), has("is an image (TIFF), which is not read"));
  test::write_file(folder / "words.asc", "ncols are columns\n");
  EXPECT_THAT(apps::inspect_file((folder / "words.asc").string()).trouble.error().message, has("a frame of a CAN bus"));
}

TEST(InspectFiles, AByteInFrontOfZerosIsNoPacketOfAnOxts) {
  const TemporaryFolder folder;
  test::write_file(folder / "program.bin", "MZ\xE7" + std::string(200, '\0'));
  const auto seen = apps::inspect_file((folder / "program.bin").string());
  EXPECT_FALSE(seen.found) << seen.found->at("format");
  EXPECT_THAT(seen.trouble.error().message, testing::HasSubstr("none of the formats that are known"));
}

TEST(InspectFiles, ReadsTheAccuraciesOfATrajectory) {
  const TemporaryFolder folder;
  std::vector<double> records;
  for (int i = 0; i < 3; ++i)
    for (const double value : {200000.0 + i, 0.02, 0.03, 0.05, 0.001, 0.002, 0.003, 0.6, 0.6, 3.0})
      records.push_back(value);
  records[11] = 0.08;  // north, of the second record
  std::string bytes(reinterpret_cast<const char*>(records.data()), records.size() * sizeof(double));
  test::write_file(folder / "accuracies.out", bytes + "cut");
  const auto seen = apps::inspect_file((folder / "accuracies.out").string());
  ASSERT_TRUE(seen.found) << seen.trouble.error().message;
  EXPECT_EQ(seen.found->at("format"), "SMRMSG");
  EXPECT_EQ(seen.found->at("records"), 3);
  EXPECT_EQ(seen.found->at("bytes_at_end"), 3);
  EXPECT_EQ(seen.found->at("gps_second_of_week"), (std::vector<double>{200000, 200002}));
  EXPECT_EQ(seen.found->at("sigma").at("north_m"), (std::vector<double>{0.02, 0.08}));
  EXPECT_EQ(seen.found->at("sigma").at("east_m"), (std::vector<double>{0.03, 0.03}));
  EXPECT_NEAR(seen.found->at("sigma").at("heading_deg").at(0).get<double>(), 0.05, 1e-12);
}

}  // namespace
}  // namespace hueline
