// Clouds that are text, as programs of static scanners and of anybody write them.
#include "storage/text_cloud.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace hueline::storage {
namespace {

std::vector<double> column_values(const Result<PcdCloud>& cloud, const char* field) {
  const auto column = cloud->column(field);
  return {column.begin(), column.end()};
}

/// The head of a scan: its columns and rows, place and axes of the scanner, and a matrix that turns x into y and moves.
std::string ptx_head(const char* columns, const char* rows, const char* x) {
  return std::string(columns) + "\r\n" + rows + "\r\n" + x + " 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n" +
         x + " 0 0 1\n";
}

TEST(TextCloud, ReadsPtxInTheFrameOfTheScannerAndOfTheFile) {
  const std::string scan = "1 2 3 0.25 1 2 3\n0 0 0 0.5 0 0 0\n";
  const std::string text = ptx_head("1", "2", "100") + scan;
  ASSERT_TRUE(is_ptx(text));
  const auto own = decode_ptx(text, "a.ptx", PtxFrame::Scanner);
  ASSERT_TRUE(own.ok()) << own.error().message;
  EXPECT_EQ(own->fields, (std::vector<std::string>{"x", "y", "z", "intensity", "red", "green", "blue"}));
  EXPECT_EQ(own->columns[1][0], 2);
  EXPECT_TRUE(std::isnan(own->columns[0][1])) << "nothing came back";
  EXPECT_EQ(column_values(own, "intensity"), (std::vector<double>{0.25, 0.5}));
  const auto in_file = decode_ptx(text, "a.ptx", PtxFrame::File);
  EXPECT_EQ(in_file->columns[0][0], 100 - 2);
  EXPECT_EQ(in_file->columns[1][0], 1);
  EXPECT_EQ(in_file->columns[2][0], 3);

  const std::string two = text + ptx_head("2", "1", "200") + "5 6 7 1\n5 6 7 1\n";
  EXPECT_EQ(decode_ptx(two, "a.ptx", PtxFrame::Scanner).error().code, ErrorCode::Unsupported);
  const auto both = decode_ptx(two, "a.ptx", PtxFrame::File);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_EQ(both->fields.size(), 4u) << "one scan has no colours";
  EXPECT_EQ(both->columns[0][3], 200 - 6);
  const auto cut = decode_ptx(text.substr(0, text.size() - 16), "a.ptx", PtxFrame::File);
  EXPECT_EQ(cut.error().code, ErrorCode::Truncated);
  EXPECT_NE(cut.error().message.find("behind 1 of the 2 points"), std::string::npos) << cut.error().message;
}

TEST(TextCloud, TakesALongLineForNoRow) {
  std::string numbers;
  for (int i = 0; i < 40'000; ++i) numbers += "1 ";
  const auto behind = decode_text_cloud("1 2 3\n" + numbers + "\n", "a.xyz");
  ASSERT_FALSE(behind.ok());
  EXPECT_NE(behind.error().message.find("line 2: '1 1"), std::string::npos) << behind.error().message;
  EXPECT_EQ(text_cloud_kind(numbers + "\n"), "");
  EXPECT_EQ(text_cloud_kind("# x y z " + numbers + "\n1 2 3\n"), "text with x y z");
}

TEST(TextCloud, ReadsPtsAndCountsItsPoints) {
  const std::string text = "2\n1 2 3 -900 10 20 30\n4 5 6 1200 0 255 7\n1\n7 8 9 0 1 2 3\n";
  EXPECT_EQ(text_cloud_kind(text), "PTS");
  const auto cloud = decode_text_cloud(text, "a.pts");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(column_values(cloud, "x"), (std::vector<double>{1, 4, 7}));
  EXPECT_EQ(column_values(cloud, "intensity"), (std::vector<double>{-900, 1200, 0}));
  EXPECT_EQ(column_values(cloud, "green"), (std::vector<double>{20, 255, 2}));
  const auto few = decode_text_cloud("3\n1 2 3 4\n1 2 3 4\n", "a.pts");
  ASSERT_FALSE(few.ok());
  EXPECT_NE(few.error().message.find("2 of the 3 points"), std::string::npos) << few.error().message;
  const auto many = decode_text_cloud("1\n1 2 3 4\n1 2 3 5\n", "a.pts");
  ASSERT_FALSE(many.ok());
  EXPECT_NE(many.error().message.find("line 3"), std::string::npos) << many.error().message;
}

TEST(TextCloud, NamesColumnsByTitleOrByTheirNumber) {
  const auto fields = [](const char* text) {
    const auto cloud = decode_text_cloud(text, "a.xyz");
    return cloud.ok() ? cloud->fields : std::vector<std::string>{cloud.error().message};
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(fields("1 2 3\n+4 5 6"), (Names{"x", "y", "z"}));
  EXPECT_EQ(fields("1,2,3,0.5\n4,5,6,0.7\n"), (Names{"x", "y", "z", "intensity"}));
  EXPECT_EQ(fields("1 2 3 0 255 9\n"), (Names{"x", "y", "z", "red", "green", "blue"}));
  EXPECT_EQ(fields("1 2 3 0.1 0.2 0.3\n"), (Names{"x", "y", "z", "column_4", "column_5", "column_6"}));
  EXPECT_EQ(fields("1 2 3 4 5 6 0.5\n"), (Names{"x", "y", "z", "red", "green", "blue", "intensity"}));
  EXPECT_EQ(fields("1 2 3 -7 255 0 9\n"), (Names{"x", "y", "z", "intensity", "red", "green", "blue"}));
  EXPECT_EQ(fields("1 2 3 4 5 6 255\n1 2 3 7 8 9 255.0\n"), (Names{"x", "y", "z", "red", "green", "blue", "alpha"}));
  EXPECT_EQ(fields("1 2 3 4 5 6 7\n1 2 3 7 8 9 255\n"),
            (Names{"x", "y", "z", "column_4", "column_5", "column_6", "column_7"}));
  EXPECT_EQ(fields("1\n1 2 3 4 5 6 255\n"), (Names{"x", "y", "z", "intensity", "red", "green", "blue"}));
  EXPECT_EQ(fields("//X Y Z Rf Gf\n1 2 3 4 5\n"), (Names{"x", "y", "z", "Rf", "Gf"}));
  EXPECT_EQ(fields("\"t\";\"x\";\"y\";\"z\"\n9;1;2;3\n"), (Names{"t", "x", "y", "z"}));
  EXPECT_EQ(fields("\"X\", \"Y\", \"Z\", \"GPS time\"\n9,1,2,3\n"), (Names{"x", "y", "z", "GPS time"}));
  EXPECT_EQ(fields("# made by hand\nX,Y,Z,Classification,Time\n1,2,3,4,5\n"),
            (Names{"x", "y", "z", "Classification", "Time"}));
  EXPECT_NE(fields("1 2 3\n1 2 x\n")[0].find("line 2: '1 2 x' is no row of 3 numbers"), std::string::npos);
  for (const char* other :
       {"FIELDS x y z\nDATA ascii\n1 2 3\n", "1305031098.6 1 2 3 0 0 0 1\n", "hello\n1 2 3\n", "", "1 2\n"})
    EXPECT_EQ(text_cloud_kind(other), "") << other;
}

}  // namespace
}  // namespace hueline::storage
