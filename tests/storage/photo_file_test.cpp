#include "storage/photo_file.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "core/angle.hpp"
#include "storage/image_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

PhotoTags munich() {
  PhotoTags tags;
  tags.description = "exposure 12";
  tags.software = "hueline";
  tags.taken = {.year = 2025, .month = 8, .day = 27, .hour = 11, .minute = 59, .second = 55, .nanosecond = 251'137'000};
  tags.exposure_s = 0.00125;
  tags.position = {48.1373500562 * kRadPerDeg, -11.5756693648 * kRadPerDeg, 567.6091};
  tags.direction = 359.999 * kRadPerDeg;
  tags.sigma_horizontal_m = 0.0141;
  tags.panorama = PanoramaPose{359.999 * kRadPerDeg, -1.5 * kRadPerDeg, 2.25 * kRadPerDeg};
  return tags;
}

/// One field of a directory, as numbers or text.
struct Field {
  std::uint16_t type = 0;
  std::uint32_t count = 0;
  std::string bytes;
  template <class T>
  T number(std::size_t index) const {
    T value{};
    if ((index + 1) * sizeof value <= bytes.size())
      std::memcpy(&value, bytes.data() + index * sizeof value, sizeof value);
    return value;
  }
  double ratio(std::size_t index) const {
    return number<std::uint32_t>(2 * index) / static_cast<double>(number<std::uint32_t>(2 * index + 1));
  }
};

/// Reads a directory of a TIFF structure by the tables of its specification.
std::map<int, Field> directory(const std::string& tiff, std::size_t at) {
  const auto number = [&](std::size_t offset, std::size_t size) {
    std::uint32_t value = 0;
    if (offset + size <= tiff.size()) std::memcpy(&value, tiff.data() + offset, size);
    return value;
  };
  std::map<int, Field> out;
  int last = -1;
  for (std::uint32_t i = 0; i < number(at, 2); ++i) {
    const std::size_t entry = at + 2 + 12 * std::size_t{i};
    const auto tag = static_cast<int>(number(entry, 2));
    EXPECT_GT(tag, last) << "tags must ascend";
    last = tag;
    Field field{static_cast<std::uint16_t>(number(entry + 2, 2)), number(entry + 4, 4), {}};
    const std::map<int, std::size_t> sizes{{1, 1}, {2, 1}, {3, 2}, {4, 4}, {5, 8}, {7, 1}};
    EXPECT_TRUE(sizes.contains(field.type));
    const std::size_t size = field.count * sizes.at(field.type);
    field.bytes = tiff.substr(size <= 4 ? entry + 8 : number(entry + 8, 4), size);
    EXPECT_EQ(field.bytes.size(), size);
    out[tag] = field;
  }
  EXPECT_EQ(number(at + 2 + 12 * std::size_t{number(at, 2)}, 4), 0u);
  return out;
}

std::string text_of(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

TEST(PhotoFile, SaysWhenAndWhereItWasTaken) {
  const std::string tiff = text_of(exif_of(munich(), 4096, 2048));
  ASSERT_EQ(tiff.substr(0, 4), std::string("II*\0", 4));
  const auto main = directory(tiff, 8);
  EXPECT_EQ(main.at(0x010E).bytes, std::string("exposure 12\0", 12));
  const auto photo = directory(tiff, main.at(0x8769).number<std::uint32_t>(0));
  EXPECT_NEAR(photo.at(0x829A).ratio(0), 0.00125, 1e-9);
  EXPECT_EQ(photo.at(0x9003).bytes, std::string("2025:08:27 11:59:55\0", 20));
  EXPECT_EQ(photo.at(0x9011).bytes, std::string("+00:00\0", 7));
  EXPECT_EQ(photo.at(0x9291).bytes, std::string("251137\0", 7));
  EXPECT_EQ(photo.at(0xA002).number<std::uint32_t>(0), 4096u);
  const auto gps = directory(tiff, main.at(0x8825).number<std::uint32_t>(0));
  EXPECT_EQ(gps.at(1).bytes, std::string("N\0", 2));
  EXPECT_EQ(gps.at(3).bytes, std::string("W\0", 2));
  EXPECT_NEAR(gps.at(2).ratio(0) + gps.at(2).ratio(1) / 60 + gps.at(2).ratio(2) / 3600, 48.1373500562, 3e-11);
  EXPECT_NEAR(gps.at(4).ratio(0) + gps.at(4).ratio(1) / 60 + gps.at(4).ratio(2) / 3600, 11.5756693648, 3e-11);
  EXPECT_EQ(gps.at(5).bytes[0], 0);
  EXPECT_NEAR(gps.at(6).ratio(0), 567.6091, 1e-6);
  EXPECT_NEAR(gps.at(7).ratio(0) * 3600 + gps.at(7).ratio(1) * 60 + gps.at(7).ratio(2), 43195.251137, 1e-6);
  EXPECT_EQ(gps.at(0x10).bytes, std::string("T\0", 2));
  EXPECT_EQ(gps.at(0x11).ratio(0), 0) << "359.999 degrees are north after rounding, not 360";
  EXPECT_EQ(gps.at(0x1D).bytes, std::string("2025:08:27\0", 11));
  EXPECT_NEAR(gps.at(0x1F).ratio(0), 0.0141, 1e-6);

  PhotoTags deep = munich();
  deep.position.ellipsoidal_height = -3;
  deep.sigma_horizontal_m = 0;
  const std::string below = text_of(exif_of(deep, 2, 1));
  const auto low = directory(below, directory(below, 8).at(0x8825).number<std::uint32_t>(0));
  EXPECT_EQ(low.at(5).bytes[0], 1);
  EXPECT_EQ(low.at(6).ratio(0), 3);
  EXPECT_FALSE(low.contains(0x1F));
}

/// The fields that EXIF 2.32 requires of a compressed picture with three components (tables 4 to 8, level M).
TEST(PhotoFile, HasTheFieldsThatExifRequires) {
  const std::string tiff = text_of(exif_of(munich(), 4096, 2048));
  const auto main = directory(tiff, 8);
  EXPECT_EQ(main.at(0x011A).ratio(0), 72);
  EXPECT_EQ(main.at(0x011B).ratio(0), 72);
  EXPECT_EQ(main.at(0x0128).number<std::uint16_t>(0), 2);
  EXPECT_EQ(main.at(0x0213).number<std::uint16_t>(0), 1);
  const auto photo = directory(tiff, main.at(0x8769).number<std::uint32_t>(0));
  EXPECT_EQ(photo.at(0x9000).bytes, "0232");
  EXPECT_EQ(photo.at(0x9101).bytes, std::string("\1\2\3\0", 4));
  EXPECT_EQ(photo.at(0xA000).bytes, "0100");
  EXPECT_EQ(photo.at(0xA001).number<std::uint16_t>(0), 1);
  EXPECT_EQ(photo.at(0xA002).number<std::uint32_t>(0), 4096u);
  EXPECT_EQ(photo.at(0xA003).number<std::uint32_t>(0), 2048u);
  EXPECT_EQ(directory(tiff, main.at(0x8825).number<std::uint32_t>(0)).at(0).bytes, std::string("\2\3\0\0", 4));
}

TEST(PhotoFile, SaysHowAPanoramaIsShown) {
  const std::string xmp = xmp_of(munich(), 4096, 2048);
  for (const char* property :
       {"UsePanoramaViewer=\"True\"", "ProjectionType=\"equirectangular\"", "PoseHeadingDegrees=\"0.00\"",
        "PosePitchDegrees=\"-1.500\"", "PoseRollDegrees=\"2.250\"", "FullPanoWidthPixels=\"4096\"",
        "FullPanoHeightPixels=\"2048\"", "CroppedAreaImageWidthPixels=\"4096\"",
        "CroppedAreaImageHeightPixels=\"2048\"", "CroppedAreaLeftPixels=\"0\"", "CroppedAreaTopPixels=\"0\"",
        "FirstPhotoDate=\"2025-08-27T11:59:55Z\""})
    EXPECT_NE(xmp.find(std::string("GPano:") + property), std::string::npos) << property;
  PhotoTags flat = munich();
  flat.panorama.reset();
  EXPECT_EQ(xmp_of(flat, 4, 2).find("GPano:Use"), std::string::npos);
}

TEST(PhotoFile, KeepsThePixelsAndCarriesTheTags) {
  const test::TemporaryFolder folder;
  RgbImage image(64, 32, {10, 200, 90});
  const RgbPixels pixels{image.pixels.data()->data(), 64, 32};
  const auto png = encode_png(pixels, munich());
  const auto jpeg = encode_jpeg(pixels, 95, munich());
  ASSERT_TRUE(png.ok() && jpeg.ok());
  for (const auto& [name, bytes] : {std::pair{"a.png", *png}, std::pair{"a.jpg", *jpeg}}) {
    test::write_file(folder / name, text_of(bytes));
    const auto back = read_image(folder / name);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->image.width, 64);
    EXPECT_EQ(back->orientation, 1);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(back->image.at(20, 20)[c], image.at(20, 20)[c], 3);
    EXPECT_NE(text_of(bytes).find(text_of(exif_of(munich(), 64, 32))), std::string::npos);
    EXPECT_NE(text_of(bytes).find(xmp_of(munich(), 64, 32)), std::string::npos);
  }
  EXPECT_EQ(*encode_jpeg(pixels, 95, munich()), *jpeg);
  EXPECT_EQ(encode_png({}, munich()).error().code, ErrorCode::Invalid);
  EXPECT_EQ(encode_jpeg({}, 95, munich()).error().code, ErrorCode::Invalid);
  EXPECT_EQ(encode_jpeg({pixels.data, 70'000, 1}, 95, munich()).error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::storage
