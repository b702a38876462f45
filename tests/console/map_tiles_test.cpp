#include "console/server/map_tiles.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace hueline::console {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

void write(const fs::path& file, const std::string& text = "tile") {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(MapTiles, AreFoundByTheirPlaceCountedFromTheNorth) {
  const TemporaryFolder folder;
  write(folder / "12/2178/1421.png");
  write(folder / "14/8714/5685.jpg");
  write(folder / "metadata.json", R"({"attribution": "© the surveyors", "minzoom": "3"})");
  fs::create_directories(folder / "13/4357");  // a level without a tile
  const auto tiles = MapTiles::open(folder.path());
  ASSERT_TRUE(tiles.ok());
  EXPECT_EQ(tiles->json().dump(), R"({"least_zoom":12,"most_zoom":14,"attribution":"© the surveyors"})");
  const auto one = tiles->tile("12/2178/1421");
  ASSERT_TRUE(one.ok());
  EXPECT_EQ(one->path, folder / "12/2178/1421.png");
  EXPECT_STREQ(one->type, "image/png");
  EXPECT_STREQ(tiles->tile("14/8714/5685")->type, "image/jpeg");
  EXPECT_EQ(tiles->tile("12/2178/1422").error().code, ErrorCode::Unavailable);
}

TEST(MapTiles, MayBeCountedFromTheSouth) {
  const TemporaryFolder of_gdal, of_metadata;
  write(of_gdal / "tilemapresource.xml");
  write(of_metadata / "metadata.json", R"({"scheme": "tms"})");
  for (const TemporaryFolder* folder : {&of_gdal, &of_metadata}) {
    write(*folder / "3/4/5.png");
    const auto tiles = MapTiles::open(folder->path());
    ASSERT_TRUE(tiles.ok());
    EXPECT_TRUE(tiles->tile("3/4/2").ok());
    EXPECT_FALSE(tiles->tile("3/4/5").ok());
  }
}

TEST(MapTiles, LeadNowhereElse) {
  const TemporaryFolder folder;
  write(folder / "1/0/0.png");
  write(folder / "secret.png");
  const auto tiles = MapTiles::open(folder.path());
  ASSERT_TRUE(tiles.ok());
  for (const char* place :
       {"", "1", "1/0", "1/0/", "/0/0", "1/0/0/0", "1/0/0.png", "../secret", "1/../../secret", "1/0/-0", "1/0/+0",
        "1/0/ 0", "1/2/0", "1/0/2", "25/0/0", "1/0/99999999999999999999", "1/%30/0", "1/0/0\n"})
    EXPECT_EQ(tiles->tile(place).error().code, ErrorCode::Invalid) << place;
}

TEST(MapTiles, AFolderWithoutThemIsRefused) {
  const TemporaryFolder folder;
  EXPECT_EQ(MapTiles::open(folder / "gone").error().code, ErrorCode::Io);
  EXPECT_EQ(MapTiles::open(folder.path()).error().code, ErrorCode::Invalid);
  write(folder / "1/0/0.pbf");
  write(folder / "metadata.json", "[]");
  EXPECT_EQ(MapTiles::open(folder.path()).error().code, ErrorCode::Invalid);
  write(folder / "1/0/0.webp");
  EXPECT_TRUE(MapTiles::open(folder.path()).ok());
}

}  // namespace
}  // namespace hueline::console
