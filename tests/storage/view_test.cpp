#include "storage/view_writer.hpp"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <map>
#include <numbers>

#include "storage/image_view.hpp"
#include "storage/mcap_reader.hpp"
#include "storage/view_fields.hpp"
#include "storage_proto/foxglove/CameraCalibration.pb.h"
#include "storage_proto/foxglove/CompressedImage.pb.h"
#include "storage_proto/foxglove/FrameTransforms.pb.h"
#include "storage_proto/foxglove/LocationFix.pb.h"
#include "storage_proto/foxglove/Log.pb.h"
#include "tests/storage/sample_view.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::TemporaryFolder;

template <class Message>
std::vector<Message> messages_of(const std::filesystem::path& path, const std::string& topic) {
  std::vector<Message> all;
  auto reader = McapReader::open(path);
  EXPECT_TRUE(reader);
  while (auto message = reader->next()) {
    if (reader->channels().at(message->channel).topic != topic) continue;
    EXPECT_TRUE(all.emplace_back().ParseFromArray(message->data.data(), static_cast<int>(message->data.size())));
  }
  return all;
}

TEST(ViewWriter, WritesTheSameBytesAgain) {
  const TemporaryFolder folder;
  ASSERT_TRUE(test::write_sample_view(folder / "a.mcap"));
  ASSERT_TRUE(test::write_sample_view(folder / "b.mcap"));
  EXPECT_EQ(test::contents(folder / "a.mcap"), test::contents(folder / "b.mcap"));
}

TEST(ViewWriter, ShowsEveryNthPoint) {
  const TemporaryFolder folder;
  ASSERT_TRUE(test::write_sample_view(folder / "view.mcap"));
  const auto clouds = messages_of<foxglove::PointCloud>(folder / "view.mcap", "/cloud");
  ASSERT_GT(clouds.size(), 10u) << "10 000 points take 23 s";
  std::size_t points = 0;
  const auto expected = test::sample_cloud(10'000);
  for (const auto& cloud : clouds) {
    EXPECT_EQ(cloud.frame_id(), "enu");
    for (std::size_t at = 0; at < cloud.data().size(); at += cloud.point_stride(), points += 10) {
      float xyz[3];
      std::memcpy(xyz, cloud.data().data() + at, sizeof xyz);
      EXPECT_EQ(xyz[1], static_cast<float>(expected.points[points].north));
      EXPECT_EQ(static_cast<std::uint8_t>(cloud.data()[at + 13]), expected.points[points].green);
    }
  }
  EXPECT_EQ(points, 10'000u);
}

/// A field that ColouredPoint does not have.
struct ViewedPoint : ColouredPoint {
  std::uint16_t views = 0;
};
constexpr auto kViewedFields =
    std::tuple_cat(kPointFields, std::tuple{PointField{&ViewedPoint::views, "views", "", "How many exposures see it.",
                                                       las_extra("views", ""), "views"}});

TEST(ViewFields, AMadeUpFieldIsOneEntryOfTheList) {
  foxglove::PointCloud before, after;
  describe_view<kPointFields>(before);
  describe_view<kViewedFields>(after);
  ASSERT_EQ(after.fields_size(), before.fields_size() + 1);
  EXPECT_EQ(after.point_stride(), before.point_stride() + 2);
  const auto& field = after.fields(before.fields_size());
  EXPECT_EQ(field.name(), "views");
  EXPECT_EQ(field.type(), foxglove::PackedElementField::UINT16);
  ViewedPoint point{test::sample_cloud(1).points[0], 515};
  std::string bytes;
  pack_view<kViewedFields>(point, bytes);
  ASSERT_EQ(bytes.size(), after.point_stride());
  std::uint16_t views;
  std::memcpy(&views, bytes.data() + field.offset(), sizeof views);
  EXPECT_EQ(views, 515);
}

TEST(ViewWriter, PutsTheVehicleWhereItIs) {
  const TemporaryFolder folder;
  ASSERT_TRUE(test::write_sample_view(folder / "view.mcap"));
  auto transforms = messages_of<foxglove::FrameTransform>(folder / "view.mcap", "/tf");
  std::erase_if(transforms, [](const auto& one) { return one.child_frame_id() != "body"; });
  ASSERT_EQ(transforms.size(), 5u) << "one in 100 ms of 50 solutions at 100 Hz";
  const auto& last = transforms.back();
  // test::sample_solutions: 11.13 m north in each step of 1e-4 degrees, heading east
  EXPECT_NEAR(last.translation().y(), 40 * 11.12, 0.5);
  EXPECT_NEAR(last.translation().x(), 0, 1e-6);
  const Eigen::Quaterniond q(last.rotation().w(), last.rotation().x(), last.rotation().y(), last.rotation().z());
  EXPECT_LT((q * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitX()).norm(), 1e-4) << "forward is east";
  // 2026-03-01T00:00:00 UTC
  EXPECT_EQ(transforms.front().timestamp().seconds(), 1'772'323'200);
  const auto fixes = messages_of<foxglove::LocationFix>(folder / "view.mcap", "/fix");
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_NEAR(fixes[0].latitude(), 48.137, 1e-9);
  EXPECT_NEAR(fixes[0].position_covariance(8), 0.09, 1e-9);
  EXPECT_EQ(messages_of<foxglove::Log>(folder / "view.mcap", "/log").at(0).level(), foxglove::Log::WARNING);
}

TEST(ViewWriter, HasAWayFromEveryFrameToEnu) {
  const TemporaryFolder folder;
  ASSERT_TRUE(test::write_sample_view(folder / "view.mcap"));
  std::map<std::string, std::string> parents;
  for (const auto& one : messages_of<foxglove::FrameTransform>(folder / "view.mcap", "/tf"))
    parents[one.child_frame_id()] = one.parent_frame_id();
  const auto mounted = messages_of<foxglove::FrameTransforms>(folder / "view.mcap", "/tf_static");
  ASSERT_EQ(mounted.size(), 1u);
  for (const auto& one : mounted[0].transforms()) parents[one.child_frame_id()] = one.parent_frame_id();
  const std::map<std::string, std::string> expected{{"antenna", "enu"},     {"body", "enu"},
                                                    {"head", "body"},       {"lens/left", "head"},
                                                    {"lens/right", "head"}, {"scanner/laser_front", "body"}};
  EXPECT_EQ(parents, expected);
  EXPECT_NEAR(mounted[0].transforms(0).translation().z(), 1.5, 1e-12);
}

TEST(ViewWriter, DescribesALensInTheReducedImage) {
  const TemporaryFolder folder;
  ASSERT_TRUE(test::write_sample_view(folder / "view.mcap"));
  const auto images = messages_of<foxglove::CompressedImage>(folder / "view.mcap", "/image/head");
  const auto lenses = messages_of<foxglove::CameraCalibration>(folder / "view.mcap", "/camera/right");
  ASSERT_EQ(lenses.size(), images.size());
  const auto& right = lenses[0];
  EXPECT_EQ(right.frame_id(), "lens/right");
  EXPECT_EQ(right.width(), 320u);
  EXPECT_EQ(right.height(), 160u);
  EXPECT_EQ(right.distortion_model(), "kannala_brandt");
  ASSERT_EQ(right.d_size(), 4);
  // Two pixels become one. The optical axis is at column 320 + 159.5 of the camera's image, which is the border of its
  // columns 479 and 480, the border of columns 239 and 240 halved: pixel centres have whole numbers.
  EXPECT_DOUBLE_EQ(right.k(0), 150);
  EXPECT_DOUBLE_EQ(right.k(2), 239.5);
  EXPECT_DOUBLE_EQ(right.k(4), 155);
  EXPECT_DOUBLE_EQ(right.k(5), 74.5);
  EXPECT_DOUBLE_EQ(right.p(2), 239.5);
  EXPECT_EQ(messages_of<foxglove::CameraCalibration>(folder / "view.mcap", "/camera/left").at(0).distortion_model(),
            "plumb_bob");
}

TEST(ViewWriter, ShowsImagesAsJpeg) {
  const TemporaryFolder folder;
  ASSERT_TRUE(test::write_sample_view(folder / "view.mcap"));
  const auto images = messages_of<foxglove::CompressedImage>(folder / "view.mcap", "/image/head");
  ASSERT_EQ(images.size(), 2u) << "one a second of three in 1.4 s";
  EXPECT_EQ(images[0].format(), "jpeg");
  tjhandle decoder = tjInitDecompress();
  int width = 0, height = 0, sampling = 0;
  auto* data = reinterpret_cast<unsigned char*>(const_cast<char*>(images[0].data().data()));
  ASSERT_EQ(tjDecompressHeader2(decoder, data, images[0].data().size(), &width, &height, &sampling), 0);
  EXPECT_EQ(width, 320);
  EXPECT_EQ(height, 160);
  std::vector<Rgb> pixels(320 * 160);
  ASSERT_EQ(tjDecompress2(decoder, data, images[0].data().size(), pixels[0].data(), width, 0, height, TJPF_RGB, 0), 0);
  tjDestroy(decoder);
  const Rgb middle = pixels[80 * 320 + 160];
  EXPECT_NEAR(middle[0], 200, 4);  // the sample image is one colour
  EXPECT_NEAR(middle[1], 100, 4);
  EXPECT_NEAR(middle[2], 50, 4);
}

TEST(ReducedView, KnowsEveryBayerOrder) {
  const std::uint8_t rgb[] = {200, 100, 50};
  const std::pair<PixelFormat, const char*> orders[] = {{PixelFormat::BayerRG8, "rggb"},
                                                        {PixelFormat::BayerBG8, "bggr"},
                                                        {PixelFormat::BayerGR8, "grbg"},
                                                        {PixelFormat::BayerGB8, "gbrg"}};
  for (const auto& [format, order] : orders) {
    std::vector<std::byte> bytes(5 + 8 * 10);  // an offset, rows of 6 with a stride of 8
    for (std::size_t y = 0; y < 10; ++y)
      for (std::size_t x = 0; x < 6; ++x) {
        const char colour = order[(y % 2) * 2 + x % 2];
        bytes[5 + y * 8 + x] = static_cast<std::byte>(rgb[colour == 'r' ? 0 : colour == 'g' ? 1 : 2]);
      }
    Image image;
    image.width = 6, image.height = 10, image.stride = 8, image.format = format;
    image.pixel_offset = 5;
    image.buffer = Buffer::copy_of(bytes);
    const auto view = reduced_view(image, 5);
    ASSERT_TRUE(view) << order;
    EXPECT_EQ(view->width, 3);
    EXPECT_EQ(view->height, 5);
    EXPECT_EQ(view->at(1, 1), (Rgb{200, 100, 50})) << order;
    image.stride = 9;
    EXPECT_EQ(reduced_view(image, 5).error().code, ErrorCode::Invalid) << "rows beyond the buffer";
  }
}

}  // namespace
}  // namespace hueline::storage
