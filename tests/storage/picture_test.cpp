#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "storage/cloud_picture.hpp"
#include "storage/image_file.hpp"
#include "storage/las_writer.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::TemporaryFolder;

/// Adds a flat square of points in one colour, `step` m apart.
void add_square(CloudBlock& block, Eigen::Vector3d corner, Eigen::Vector3d side_a, Eigen::Vector3d side_b, double step,
                Rgb colour, ColourState state = ColourState::Direct) {
  const auto count_a = static_cast<int>(side_a.norm() / step), count_b = static_cast<int>(side_b.norm() / step);
  for (int a = 0; a <= count_a; ++a)
    for (int b = 0; b <= count_b; ++b) {
      const Eigen::Vector3d at = corner + side_a * a / count_a + side_b * b / count_b;
      ColouredPoint p;
      p.east = at.x(), p.north = at.y(), p.up = at.z();
      p.red = colour[0], p.green = colour[1], p.blue = colour[2];
      p.state = state;
      block.points.push_back(p);
    }
}

Eigen::Vector3d write_las(const std::filesystem::path& path, const CloudBlock& block) {
  auto writer = LasWriter::create(path, block.origin, {});
  EXPECT_TRUE(writer && writer->append(block) && writer->close());
  return writer->projection().project_exactly(0, 0, 0);
}

const Rgb kRed{200, 20, 20}, kGreen{20, 180, 20}, kBlue{20, 20, 220}, kWhite{255, 255, 255};

TEST(Png, GivesBackItsPixels) {
  const TemporaryFolder folder;
  RgbImage image(37, 11, {1, 2, 3});
  for (int x = 0; x < image.width; ++x) image.at(x, 5) = {static_cast<std::uint8_t>(x * 7), 0, 255};
  ASSERT_TRUE(write_png(folder / "a.png", image));
  const auto back = read_png(folder / "a.png");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->width, 37);
  EXPECT_EQ(back->pixels, image.pixels);
}

/// Pixels are taken as they are stored, also of kinds that this program does not write.
TEST(Png, ReadsSixteenBitsAndWhatIsTransparentAsItIsStored) {
  const TemporaryFolder folder;
  // One pixel of 116, 30, 240: with 16 bits, which are 257 times as much, and half transparent.
  for (const std::string hex :
       {"89504e470d0a1a0a0000000d4948445200000001000000011002000000c0e78f9d0000000f49444154789c6328299193"
        "fbf0010008a50305f9c8a7800000000049454e44ae426082",
        "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c632891fbd0"
        "0000048f0203447138650000000049454e44ae426082"}) {
    std::string bytes;
    for (std::size_t i = 0; i < hex.size(); i += 2)
      bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    test::write_file(folder / "a.png", bytes);
    const auto image = read_png(folder / "a.png");
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->at(0, 0), (Rgb{116, 30, 240}));
  }
}

/// Cameras of 12 bits, whose programs write them as the lower ones of 16.
TEST(Png, AnImageOfTwelveBitsIsAsBrightAsItIs) {
  const TemporaryFolder folder;
  // Two pixels, 16 times 116, 30, 240 and 255, 0, 8; the second file states the curve of sRGB.
  for (const std::string hex :
       {"89504e470d0a1a0a0000000d49484452000000020000000110020000002bd0349e0000001549444154789c636077607c"
        "c0cfc0ff9f8181a10100115802c6fd9ef7a20000000049454e44ae426082",
        "89504e470d0a1a0a0000000d49484452000000020000000110020000002bd0349e0000000467414d410000b18f0bfc61"
        "050000001549444154789c636077607cc0cfc0ff9f8181a10100115802c6fd9ef7a20000000049454e44ae426082"}) {
    std::string bytes;
    for (std::size_t i = 0; i < hex.size(); i += 2)
      bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    test::write_file(folder / "a.png", bytes);
    const auto image = read_image(folder / "a.png");
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->image.at(0, 0), (Rgb{116, 30, 240}));
    EXPECT_EQ(image->image.at(1, 0), (Rgb{255, 0, 8}));
  }
  RgbImage night(2, 1, {3, 2, 1});
  ASSERT_TRUE(write_png(folder / "night.png", night));
  EXPECT_EQ(read_image(folder / "night.png")->image.pixels, night.pixels) << "8 bits are all there are";
}

TEST(Png, TellsWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(write_png("/nonexistent/a.png", RgbImage(1, 1, {})).error().code, ErrorCode::Io);
  EXPECT_EQ(write_png("/dev/full", RgbImage(100, 100, {})).error().code, ErrorCode::Io);
  EXPECT_EQ(write_png(folder / "a.png", {}).error().code, ErrorCode::Invalid);
  EXPECT_EQ(read_png(folder / "absent.png").error().code, ErrorCode::Io);
  test::write_file(folder / "broken.png", "\x89PNG and no more");
  EXPECT_EQ(read_png(folder / "broken.png").error().code, ErrorCode::Malformed);
}

TEST(TopView, ShowsTheHighestPointWhereItIs) {
  const TemporaryFolder folder;
  CloudBlock block{test::sample_origin(), {}};
  add_square(block, {-20, -10, 0}, {40, 0, 0}, {0, 20, 0}, 0.05, kBlue);  // ground
  add_square(block, {10, 5, 4}, {5, 0, 0}, {0, 4, 0}, 0.05, kRed);        // a roof in the north-east
  add_square(block, {-15, -8, 9}, {3, 0, 0}, {0, 3, 0}, 0.05, kGreen,
             ColourState::NoExposure);  // higher, but without a colour
  block.points.push_back({});
  block.points.back().east = 5000;  // one stray return must not shrink the picture of the rest
  const Eigen::Vector3d origin = write_las(folder / "cloud.las", block);
  TopViewConfig config;
  config.longest_side_px = 800;
  const auto view = picture_from_above(folder / "cloud.las", config);
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->image.width, 800);
  EXPECT_LT(view->cell_m, 0.1);
  const auto at = [&](double east, double north) {
    // The scale of the map and the convergence move these points by centimetres only.
    return view->image.at(static_cast<int>((origin.x() + east - view->west) / view->cell_m),
                          static_cast<int>((view->north - origin.y() - north) / view->cell_m));
  };
  EXPECT_EQ(at(12, 7), kRed);
  EXPECT_EQ(at(0, 0), kBlue);
  EXPECT_EQ(at(-14, -7), kBlue) << "a coloured point goes before an uncoloured one above it";
  EXPECT_EQ(at(-5, 3), kBlue);
  // The scale bar is as long as its text says.
  int longest = 0;
  for (int y = view->image.height - 60; y < view->image.height; ++y)
    for (int x = 0, run = 0; x < view->image.width; ++x)
      longest = std::max(longest, run = view->image.at(x, y) == kWhite ? run + 1 : 0);
  EXPECT_NEAR(longest * view->cell_m, view->scale_bar_m, view->cell_m);
  EXPECT_EQ(view->scale_bar_m, 10.0);
}

TEST(StreetView, HidesWhatIsBehindAndKeepsLeftAndRight) {
  const TemporaryFolder folder;
  CloudBlock block{test::sample_origin(), {}};
  add_square(block, {-8, 10, -2}, {8, 0, 0}, {0, 0, 6}, 0.06, kGreen);  // wall 10 m ahead, left half
  add_square(block, {-8, 14, -2}, {16, 0, 0}, {0, 0, 6}, 0.03, kRed);   // dense wall behind it, both halves
  add_square(block, {-8, 1, -2}, {16, 0, 0}, {0, 13, 0}, 0.06, kBlue);  // ground
  const Eigen::Vector3d origin = write_las(folder / "cloud.las", block);
  StreetViewConfig config;
  config.position = origin;
  // The north of the map is turned against true north by the convergence of the meridians, and so is the view.
  auto projection = Projection::create(block.origin);
  const Eigen::Vector3d ahead = projection->project_exactly(0, 100, 0) - origin;
  config.heading = std::atan2(ahead.x(), ahead.y());
  config.width = 640;
  config.height = 480;
  const auto view = picture_from_street(folder / "cloud.las", config);
  ASSERT_TRUE(view) << view.error().message;
  int see_through = 0, holes = 0;
  for (int y = 200; y < 295; ++y)
    for (int x = 100; x < 300; ++x) {
      see_through += view->image.at(x, y) == kRed;
      holes += view->image.at(x, y) != kGreen;
    }
  EXPECT_EQ(see_through, 0) << "the near wall must be solid";
  EXPECT_EQ(holes, 0);
  EXPECT_EQ(view->image.at(400, 240), kRed);
  EXPECT_EQ(view->image.at(320, 400), kBlue);
  EXPECT_NE(view->image.at(320, 20), kRed) << "sky";

  config.heading += std::numbers::pi;  // in the opposite direction there is nothing
  const auto back = picture_from_street(folder / "cloud.las", config);
  ASSERT_TRUE(back);
  EXPECT_NE(back->image.at(320, 240), kRed);
  EXPECT_NE(back->image.at(320, 240), kGreen);
}

TEST(Pictures, SayThatTheirCloudWasCut) {
  const TemporaryFolder folder;
  CloudBlock block{test::sample_origin(), {}};
  add_square(block, {-8, 10, -2}, {8, 0, 0}, {0, 0, 6}, 0.06, kGreen);
  const auto file = folder / "cloud.las";
  StreetViewConfig street;
  street.position = write_las(file, block);
  EXPECT_TRUE(picture_from_above(file)->read.ok());
  EXPECT_TRUE(picture_from_street(file, street)->read.ok());
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 100);
  const auto above = picture_from_above(file);
  ASSERT_TRUE(above.ok());
  EXPECT_EQ(above->read.error().code, ErrorCode::Truncated);
  const auto along = picture_from_street(file, street);
  ASSERT_TRUE(along.ok());
  EXPECT_EQ(along->read.error().code, ErrorCode::Truncated);
}

TEST(Pictures, TellWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(picture_from_above(folder / "absent.las").error().code, ErrorCode::Io);
  write_las(folder / "empty.las", {test::sample_origin(), {}});
  EXPECT_EQ(picture_from_above(folder / "empty.las").error().code, ErrorCode::Invalid);
  TopViewConfig top;
  top.longest_side_px = 1;
  EXPECT_NE(top.validate().find("longest_side_px"), std::string::npos);
  StreetViewConfig street;
  street.horizontal_view = 3;
  EXPECT_NE(street.validate().find("horizontal_view"), std::string::npos);
  EXPECT_TRUE(StreetViewConfig().validate().empty());
}

}  // namespace
}  // namespace hueline::storage
