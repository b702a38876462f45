#include "drivers/v4l2/v4l2_control.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <filesystem>
#include <fstream>

#include "drivers/v4l2/v4l2_camera.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::drivers {
namespace {

using Kind = V4l2Control::Kind;
using testing::HasSubstr;

// The controls of a UVC camera, as its driver describes them.
const std::vector<V4l2Control> kUvc{
    {.id = V4L2_CID_BRIGHTNESS, .name = "brightness", .kind = Kind::Number, .min = -64, .max = 64, .step = 1},
    {.id = V4L2_CID_GAIN, .name = "gain", .kind = Kind::Number, .min = 10, .max = 100, .step = 5},
    {.id = V4L2_CID_AUTO_WHITE_BALANCE, .name = "white_balance_automatic", .kind = Kind::Truth, .min = 0, .max = 1},
    {.id = V4L2_CID_EXPOSURE_AUTO,
     .name = "auto_exposure",
     .kind = Kind::Menu,
     .min = 0,
     .max = 3,
     .items = {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}}},
    {.id = V4L2_CID_POWER_LINE_FREQUENCY,
     .name = "power_line_frequency",
     .kind = Kind::Menu,
     .min = 0,
     .max = 2,
     .items = {{0, "Disabled"}, {1, "50 Hz"}, {2, "60 Hz"}}},
    {.id = V4L2_CID_EXPOSURE_ABSOLUTE, .name = "exposure_time_absolute", .kind = Kind::Number, .min = 1, .max = 5000},
    {.id = V4L2_CID_JPEG_ACTIVE_MARKER, .name = "markers", .kind = Kind::Bits, .min = 0, .max = 0x5},
    {.id = 99, .name = "temperature", .kind = Kind::Number, .min = 0, .max = 99, .is_read_only = true},
};

std::string value_of(const char* name, const char* value) {
  const auto control = find_v4l2_control(kUvc, name);
  if (!control) return control.error().message;
  const auto number = v4l2_control_value(**control, value);
  return number ? std::to_string(*number) : number.error().message;
}

TEST(V4l2Controls, NamesAreThoseOfV4l2Ctl) {
  EXPECT_EQ(v4l2_control_name("Exposure Time, Absolute"), "exposure_time_absolute");
  EXPECT_EQ(v4l2_control_name("White Balance Temperature, Auto "), "white_balance_temperature_auto");
  EXPECT_EQ(v4l2_control_name("Gain"), "gain");
  EXPECT_EQ(v4l2_control_name(""), "");
}

TEST(V4l2Controls, ValuesAreCheckedByKind) {
  EXPECT_EQ(value_of("brightness", "-64"), "-64");
  EXPECT_EQ(value_of("gain", "0x0a"), "10");
  EXPECT_EQ(value_of("white_balance_automatic", "true"), "1");
  EXPECT_EQ(value_of("white_balance_automatic", "0"), "0");
  EXPECT_EQ(value_of("auto_exposure", "1"), "1");
  EXPECT_EQ(value_of("auto_exposure", "aperture priority mode"), "3");
  EXPECT_EQ(value_of("power_line_frequency", "50 Hz"), "1");
  EXPECT_THAT(value_of("power_line_frequency", "50"), HasSubstr("0 (Disabled), 1 (50 Hz), 2 (60 Hz)"));
  EXPECT_EQ(value_of("markers", "5"), "5");
  EXPECT_EQ(value_of("brightness", "65"), "control brightness cannot be 65; allowed: brightness: -64 to 64");
  EXPECT_EQ(value_of("gain", "12"), "control gain cannot be 12; allowed: gain: 10 to 100 in steps of 5");
  EXPECT_EQ(value_of("auto_exposure", "2"),
            "control auto_exposure cannot be 2; allowed: auto_exposure: 1 (Manual Mode), 3 (Aperture Priority Mode)");
  EXPECT_THAT(value_of("brightness", "much"), HasSubstr("cannot be much"));
  EXPECT_THAT(value_of("brightness", "1.5"), HasSubstr("cannot be 1.5"));
  EXPECT_THAT(value_of("brightness", "99999999999999999999"), HasSubstr("cannot be"));
  EXPECT_THAT(value_of("markers", "2"), HasSubstr("bits of 0x5"));
  EXPECT_THAT(value_of("temperature", "5"), HasSubstr("is read only"));
}

TEST(V4l2Controls, AnUnknownOneIsAnsweredWithAllThatExist) {
  const std::string message = value_of("brightnes", "1");
  EXPECT_THAT(message,
              HasSubstr("no control brightnes; did you mean brightness? It has: brightness: -64 to 64; gain:"));
  EXPECT_THAT(message, HasSubstr("temperature: 0 to 99, read only"));
  EXPECT_THAT(value_of("zoom", "1"), HasSubstr("no control zoom. It has:"));
}

TEST(V4l2Controls, TheExposureTurnsItsAutomaticOff) {
  const auto settings = with_exposure(kUvc, std::chrono::microseconds(2040), {{"gain", "20"}});
  ASSERT_TRUE(settings.ok());
  std::vector<std::string> texts;
  for (const V4l2Setting& setting : *settings) texts.push_back(setting.name + "=" + setting.value);
  EXPECT_THAT(texts, testing::ElementsAre("auto_exposure=1", "exposure_time_absolute=20", "gain=20"));
}

TEST(V4l2Controls, AnExposureThatNothingSetsIsRefused) {
  const std::vector<V4l2Control> sensor{
      {.id = V4L2_CID_EXPOSURE, .name = "exposure", .kind = Kind::Number, .min = 4, .max = 1100}};
  const auto without = with_exposure(sensor, std::chrono::milliseconds(2), {});
  ASSERT_FALSE(without.ok());
  EXPECT_EQ(without.error().code, ErrorCode::Invalid);
  EXPECT_THAT(without.error().message, HasSubstr("exposure: 4 to 1100"));
  const auto with = with_exposure(sensor, std::chrono::milliseconds(2), {{"exposure", "300"}});
  ASSERT_TRUE(with.ok());
  EXPECT_EQ(with->size(), 1u);
  EXPECT_TRUE(with_exposure({}, std::nullopt, {}).ok());
}

TEST(V4l2Cameras, TheSerialNumberIsThatOfTheUsbDevice) {
  const test::TemporaryFolder folder;
  const std::filesystem::path device = folder.path() / "1-2";
  std::filesystem::create_directories(device / "1-2:1.0");
  EXPECT_EQ(usb_serial_of(device / "1-2:1.0"), "");
  std::ofstream(device / "serial") << "A1B2C3\n";
  EXPECT_EQ(usb_serial_of(device / "1-2:1.0"), "A1B2C3");
}

}  // namespace
}  // namespace hueline::drivers
