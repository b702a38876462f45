#include <gtest/gtest.h>
#include <webp/demux.h>

#include <memory>

#include "storage/cloud_picture.hpp"
#include "storage/las_writer.hpp"
#include "storage/webp.hpp"
#include "tests/storage/sample_cloud.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::TemporaryFolder;

struct Frame {
  RgbImage image;
  int shown_until_ms = 0;
  /// Number of pixels in the colour of the test's street, and of pixels in light grey.
  int red = 0, grey = 0;
};

/// Returns the frames that libwebp's decoder finds.
std::vector<Frame> decode(const Bytes& file) {
  const WebPData data{reinterpret_cast<const std::uint8_t*>(file.data()), file.size()};
  const std::unique_ptr<WebPAnimDecoder, void (*)(WebPAnimDecoder*)> decoder(WebPAnimDecoderNew(&data, nullptr),
                                                                             WebPAnimDecoderDelete);
  WebPAnimInfo info;
  if (!decoder || !WebPAnimDecoderGetInfo(decoder.get(), &info)) {
    ADD_FAILURE() << "no animated WebP";
    return {};
  }
  EXPECT_EQ(info.loop_count, 0u) << "repeats without end";
  std::vector<Frame> frames;
  std::uint8_t* pixels = nullptr;
  for (int until_ms = 0; WebPAnimDecoderGetNext(decoder.get(), &pixels, &until_ms);) {
    Frame frame{RgbImage(static_cast<int>(info.canvas_width), static_cast<int>(info.canvas_height), {}), until_ms};
    for (std::size_t i = 0; i < frame.image.pixels.size(); ++i) {
      const int r = pixels[4 * i], g = pixels[4 * i + 1], b = pixels[4 * i + 2];
      frame.image.pixels[i] = {pixels[4 * i], pixels[4 * i + 1], pixels[4 * i + 2]};
      frame.red += r > 120 && g < 80 && b < 80;
      frame.grey += r > 90 && std::abs(r - g) < 30 && std::abs(g - b) < 30;
    }
    frames.push_back(std::move(frame));
  }
  EXPECT_EQ(frames.size(), info.frame_count);
  return frames;
}

constexpr double kSpeed = 8;  // m/s, northwards

/// Returns flat red ground, measured for 10 s within 8 m of a vehicle. An exposure owns each `exposure_s`.
CloudBlock street(double exposure_s, ColourState state = ColourState::Direct) {
  CloudBlock block{test::sample_origin(), {}};
  for (int i = 0; i < 40'000; ++i) {
    const double t = i * 0.25e-3, angle = i * 2.399963, distance = 8 * std::sqrt((i * 7919 % 10'000) / 10'000.0);
    ColouredPoint p;
    p.east = distance * std::sin(angle), p.north = kSpeed * t + distance * std::cos(angle);
    p.time = gps_time_ns(1'456'000'000'000'000'000ll + static_cast<std::int64_t>(t * 1e9));
    p.red = 200, p.green = 20, p.blue = 20;
    p.state = state;
    p.exposure = static_cast<std::uint32_t>(t / exposure_s);
    p.reflectivity = 200;
    block.points.push_back(p);
  }
  return block;
}

void write_cloud(const std::filesystem::path& path, const CloudBlock& block) {
  const LasWriter::Config as_it_is;  // g++ 12 warns of a temporary one
  auto writer = LasWriter::create(path, block.origin, as_it_is);
  EXPECT_TRUE(writer && writer->append(block) && writer->close());
}

/// Settings for eight seconds from the begin on, with four frames a second of drive.
MovingViewConfig quick() {
  MovingViewConfig config;
  config.start = 0;
  config.drive_s = 8;
  config.speed = 2;
  config.frames_per_s = 2;
  config.width = 160;
  config.height = 90;
  return config;
}

TEST(MovingView, HasTheFramesAndTheLengthThatWereAskedFor) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", street(0.5));
  const auto view = picture_while_driving(folder / "cloud.las", quick());
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_TRUE(view->read.ok());
  const std::vector<Frame> frames = decode(view->webp);
  ASSERT_EQ(frames.size(), 8u);
  EXPECT_EQ(view->frames, 8);
  EXPECT_EQ(frames[0].image.width, 160);
  EXPECT_EQ(frames[0].image.height, 90);
  for (std::size_t i = 0; i + 1 < frames.size(); ++i)
    EXPECT_EQ(frames[i].shown_until_ms, 500 * (static_cast<int>(i) + 1));
  EXPECT_GT(frames.back().shown_until_ms, 4000) << "the last frame stays";
}

TEST(MovingView, ShowsMoreColouredStreetTheFartherTheVehicleIs) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", street(0.5));
  MovingViewConfig config = quick();
  config.behind_m = 120;  // so that all of the street is in the picture to the end
  config.above_m = 30;
  const auto view = picture_while_driving(folder / "cloud.las", config);
  ASSERT_TRUE(view) << view.error().message;
  const std::vector<Frame> frames = decode(view->webp);
  ASSERT_EQ(frames.size(), 8u);
  EXPECT_EQ(frames[0].red, 0) << "nothing is coloured before its exposure is over";
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].red, frames[i - 1].red + 50) << i;
}

TEST(MovingView, ShowsReturnsInGreyUntilTheirExposureIsOver) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", street(5.0));
  const auto view = picture_while_driving(folder / "cloud.las", quick());
  ASSERT_TRUE(view) << view.error().message;
  const std::vector<Frame> frames = decode(view->webp);  // at 0, 1, 2 ... s
  ASSERT_EQ(frames.size(), 8u);
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_EQ(frames[i].red, 0) << i;
    EXPECT_GT(frames[i].grey, 100) << i;
  }
  EXPECT_GT(frames[5].red, 1000);
  EXPECT_LT(frames[5].grey, 100);
  EXPECT_GT(frames[7].grey, 100) << "the second exposure is not over";
}

TEST(MovingView, NeverColoursWhatHasNoColour) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", street(0.5, ColourState::NoExposure));
  const auto view = picture_while_driving(folder / "cloud.las", quick());
  ASSERT_TRUE(view) << view.error().message;
  const std::vector<Frame> frames = decode(view->webp);
  for (const Frame& frame : frames) EXPECT_EQ(frame.red, 0);
  EXPECT_GT(frames.back().grey, 1000);
}

TEST(MovingView, IsTheSameBytesAgain) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", street(0.5));
  const auto once = picture_while_driving(folder / "cloud.las", quick());
  const auto again = picture_while_driving(folder / "cloud.las", quick());
  ASSERT_TRUE(once && again);
  EXPECT_TRUE(once->webp == again->webp);
}

TEST(MovingView, HoldsAnEvenShareOfTooManyPoints) {
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.las", street(0.5));
  MovingViewConfig config = quick();
  const auto all = picture_while_driving(folder / "cloud.las", config);
  config.most_points = 5000;
  const auto share = picture_while_driving(folder / "cloud.las", config);
  ASSERT_TRUE(all && share);
  const std::vector<Frame> of_all = decode(all->webp), of_share = decode(share->webp);
  ASSERT_EQ(of_share.size(), of_all.size());
  for (std::size_t i = 4; i < of_all.size(); ++i) {
    EXPECT_LT(of_share[i].red, of_all[i].red) << i;
    EXPECT_GT(of_share[i].red, of_all[i].red / 20) << "every part of the drive is there, frame " << i;
  }
}

TEST(MovingView, SaysThatItsCloudWasCut) {
  const TemporaryFolder folder;
  const auto file = folder / "cloud.las";
  write_cloud(file, street(0.5));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) * 3 / 4);
  const auto view = picture_while_driving(file, quick());
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->read.error().code, ErrorCode::Truncated);
  EXPECT_EQ(decode(view->webp).size(), 7u) << "what there is of it: 7.5 s";
}

TEST(MovingView, TellsWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(picture_while_driving(folder / "absent.las").error().code, ErrorCode::Io);
  write_cloud(folder / "empty.las", {test::sample_origin(), {}});
  EXPECT_EQ(picture_while_driving(folder / "empty.las").error().code, ErrorCode::Unsupported);
  CloudBlock moment = street(0.5);
  moment.points.resize(1000);
  write_cloud(folder / "moment.las", moment);
  const auto of_moment = picture_while_driving(folder / "moment.las");
  ASSERT_FALSE(of_moment);
  EXPECT_NE(of_moment.error().message.find("moment.las: less than 0.5 s"), std::string::npos);
  CloudBlock thin{test::sample_origin(), {street(0.5).points.front(), street(0.5).points.back()}};
  write_cloud(folder / "thin.las", thin);
  const auto of_thin = picture_while_driving(folder / "thin.las");
  ASSERT_FALSE(of_thin);
  EXPECT_NE(of_thin.error().message.find("too few points"), std::string::npos);

  LasHeader header;  // format 0 has no times
  header.point_format = 0;
  header.header_size = header.point_offset = kLasHeaderSize14;
  header.point_size = static_cast<std::uint16_t>(las_point_size(0));
  header.point_count = 100;
  Bytes timeless = encode_las_header(header);
  timeless.resize(timeless.size() + 100u * header.point_size);
  test::write_file(folder / "timeless.las", {reinterpret_cast<const char*>(timeless.data()), timeless.size()});
  EXPECT_EQ(picture_while_driving(folder / "timeless.las").error().code, ErrorCode::Unsupported);

  MovingViewConfig config;
  EXPECT_TRUE(config.validate().empty());
  config.speed = 0;
  EXPECT_NE(config.validate().find("speed"), std::string::npos);
  EXPECT_EQ(picture_while_driving(folder / "thin.las", config).error().code, ErrorCode::Invalid);
}

TEST(Webp, TellsWhatIsWrong) {
  EXPECT_EQ(WebpAnimation::create(0, 10, 50).error().code, ErrorCode::Invalid);
  EXPECT_EQ(WebpAnimation::create(20'000, 10, 50).error().code, ErrorCode::Invalid);
  EXPECT_EQ(WebpAnimation::create(10, 10, 101).error().code, ErrorCode::Invalid);
  auto animation = WebpAnimation::create(10, 10, 50);
  ASSERT_TRUE(animation);
  EXPECT_EQ(animation->add(RgbImage(11, 10, {}), 40).error().code, ErrorCode::Invalid);
  EXPECT_EQ(animation->add(RgbImage(10, 10, {}), 0).error().code, ErrorCode::Invalid);
  EXPECT_EQ(animation->finish().error().code, ErrorCode::Invalid) << "no picture";
}

}  // namespace
}  // namespace hueline::storage
