#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"
#include "config/sheet.hpp"
#include "config/shipped.hpp"
#include "drivers/gige/genicam_device.hpp"
#include "drivers/novatel/novatel_device.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::config {
namespace {

int load_all(const std::filesystem::path& folder, auto load) {
  int loaded = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
    if (file.is_directory()) continue;
    EXPECT_NO_THROW(load(file.path().string())) << file.path();
    ++loaded;
  }
  return loaded;
}

TEST(Shipped, EveryRigAndScenarioLoads) {
  EXPECT_GE(load_all(test::source_dir() / "config/rigs", [](const std::string& path) { load_rig(path); }), 1);
  EXPECT_GE(load_all(test::source_dir() / "config/scenarios", load_scenario), 3);
}

TEST(Shipped, EverySheetNamesScenariosThatLoad) {
  const auto folder = test::source_dir() / "config/sheets";
  EXPECT_GE(load_all(folder,
                     [](const std::string& sheet) {
                       for (const auto& scenario : load_sheet(sheet).scenarios) load_scenario(scenario.string());
                     }),
            2);
  EXPECT_THROW(load_sheet("no_such_sheet"), ConfigError);
}

TEST(Shipped, ComesWithTheProgramAsItStandsInTheFolder) {
  std::size_t files = 0;
  for (const char* kind : {"rigs", "scenarios", "sheets"})
    for (const auto& file : std::filesystem::recursive_directory_iterator(test::source_dir() / "config" / kind))
      files += file.path().extension() == ".yaml";
  EXPECT_EQ(shipped_files().size(), files);
  for (const ShippedFile& file : shipped_files())
    EXPECT_EQ(read_configuration(std::string(kShipped) + std::string(file.path)),
              read_configuration((test::source_dir() / "config" / file.path).string()))
        << file.path;
}

TEST(Shipped, IsFoundByItsNameFromAnyFolder) {
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path("/");
  const Sheet sheet = load_sheet("quick");
  EXPECT_GE(sheet.scenarios.size(), 5u);
  for (const auto& scenario : sheet.scenarios) EXPECT_NO_THROW(load_scenario(scenario.string())) << scenario;
  EXPECT_NO_THROW(load_scenario("street"));
  EXPECT_NO_THROW(load_rig("street"));
  std::filesystem::current_path(before);
}

TEST(Shipped, GivesWayToAUsersFile) {
  const test::TemporaryFolder folder;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  test::write_file(folder / "quick", "scenarios: [mine.yaml]\n");
  EXPECT_EQ(load_sheet("quick").scenarios.at(0), "mine.yaml");
  EXPECT_EQ(load_sheet("./quick").scenarios.at(0), "mine.yaml");
  std::filesystem::create_directory("street");  // of results
  EXPECT_NO_THROW(load_scenario("street"));
  std::filesystem::current_path(before);
  try {
    load_sheet("qick");
    ADD_FAILURE() << "a sheet that nobody has was loaded";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean quick?"), std::string::npos) << e.what();
  }
}

TEST(Shipped, JpegPlanesReachTheDecoderAndLeaveTheTransportItsBytes) {
  const Rig rig = load_rig((test::source_dir() / "config/rigs/ladybug5_jpeg.yaml").string());
  const auto camera_of = [](const Rig& given) {
    for (const Sensor& sensor : given.sensors)
      if (const auto* found = dynamic_cast<const drivers::GenicamDevice*>(sensor.device.get())) return found;
    return static_cast<const drivers::GenicamDevice*>(nullptr);
  };
  const drivers::GenicamDevice* camera = camera_of(rig);
  ASSERT_NE(camera, nullptr);
  const auto decoder = camera->decoder();
  EXPECT_EQ(decoder.payload, drivers::ImagePayload::JpegPlanes);
  EXPECT_EQ(decoder.planes.lens_columns, 3u);
  EXPECT_EQ(decoder.pixel_format, PixelFormat::BayerRG8);
  EXPECT_EQ(decoder.width, 7344u);
  EXPECT_EQ(camera->source().width, 0u);
  EXPECT_EQ(camera->source().pixel_format, PixelFormat::Mono8);
  EXPECT_EQ(camera->sent_format(), PixelFormat::Mono8);
  EXPECT_EQ(std::count(decoder.planes.is_used.begin(), decoder.planes.is_used.end(), true), 6);

  // Without the lens that looks up, no lens has its planes.
  std::string text = rig.text;
  const std::size_t last = text.find("    - name: lens5"), end = text.find("\ncolouring:");
  ASSERT_NE(last, std::string::npos);
  ASSERT_NE(end, std::string::npos);
  text.erase(last, end - last);
  const Rig fewer = parse_rig(text, "fewer");
  ASSERT_NE(camera_of(fewer), nullptr);
  EXPECT_FALSE(camera_of(fewer)->decoder().planes.is_used[5]);
  EXPECT_TRUE(camera_of(fewer)->decoder().planes.is_used[0]);
}

TEST(Shipped, ATypoInARigIsRefusedWithItsLine) {
  const Rig rig = load_rig((test::source_dir() / "config/rigs/street.yaml").string());
  std::string text = rig.text;
  text.replace(text.find("event_input"), 11, "event_imput");
  try {
    parse_rig(text, "rig.yaml");
    FAIL() << "a typo was taken";
  } catch (const ConfigError& e) {
    const std::string said = e.what();
    EXPECT_NE(said.find("rig.yaml:"), std::string::npos) << said;
    EXPECT_NE(said.find("event_i"), std::string::npos) << said;
  }
}

std::string small_rig(const std::string& camera_lines, const std::string& end) {
  return "rig: r\nsensors:\n  - {name: pos, driver: novatel, tcp: {host: h, port: 3001}, logs: {commands: [UNLOG "
         "COM1]}}\n"
         "  - {name: camera, driver: genicam, serial: x, pixel_format: Mono8, width: 64, height: 64, exposure_us: "
         "1000, " +
         camera_lines +
         "}\nhead:\n  T_body_head: {position_m: [0, 0, 0], rotation_deg: [0, 0, 0]}\n"
         "  panorama: {width: 800, height: 400, stitching_radius_m: 20}\n  lenses:\n"
         "    - {name: a, camera: camera, offset_px: [0, 0], width: 64, height: 64, model: brown, focal_px: [60, 60],\n"
         "       principal_point_px: [31, 31], distortion: [], T_head_lens: {position_m: [0, 0, 0], rotation_deg: [0, "
         "0, 0]}}\n" +
         end;
}

TEST(Shipped, ACamerasOwnClockAndCommandsOfTheReceiverAreRead) {
  const Rig rig =
      parse_rig(small_rig("event_input: 0, counter_offset_s: -315964819", "colouring: {method: lens}\n"), "r");
  ASSERT_EQ(rig.sync.cameras.size(), 1u);
  EXPECT_EQ(rig.sync.cameras[0].counter_offset, std::chrono::seconds(-315964819));
  EXPECT_NE(dynamic_cast<const drivers::NovatelDevice&>(*rig.sensors[0].device).dialogue().find("UNLOG COM1\r\n"),
            std::string::npos);
  EXPECT_THROW(parse_rig(small_rig("event_input: 1, counter_offset_s: -315964819", "colouring: {method: lens}\n"), "r"),
               ConfigError)
      << "a strobe and a disciplined clock exclude each other";
}

TEST(Shipped, ACameraThatChoosesItsExposuresMustReportThem) {
  const std::string end = "colouring: {method: lens}\n";
  const Rig fixed = parse_rig(small_rig("event_input: 1", end), "r");
  EXPECT_FALSE(fixed.sync.cameras.at(0).must_report);
  EXPECT_EQ(fixed.sync.cameras.at(0).exposure, std::chrono::milliseconds(1));
  const Rig automatic = parse_rig(small_rig("event_input: 1, auto_exposure: true", end), "r");
  EXPECT_TRUE(automatic.sync.cameras.at(0).must_report);
  EXPECT_THROW(parse_rig(small_rig("event_input: 1, auto_exposure: true, chunks: false", end), "r"), ConfigError);
}

TEST(Shipped, ASecondPosIsRefused) {
  const std::string pos = "  - {name: NAME, driver: novatel, tcp: {host: h, port: 3001}}\n";
  const auto named = [&](const char* name) { return std::string(pos).replace(pos.find("NAME"), 4, name); };
  const std::string begin = "rig: r\nsensors:\n", end = "colouring: {method: lens}\n";
  EXPECT_NO_THROW(parse_rig(begin + named("a") + end, "r"));
  EXPECT_THROW(parse_rig(begin + named("a") + named("b") + end, "r"), ConfigError);
}

TEST(Shipped, ARangeIsRefusedAtItsOwnKey) {
  const auto said = [](const std::string& end) {
    try {
      parse_rig(small_rig("event_input: 1", end), "r");
    } catch (const ConfigError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(said("colouring: {method: lens, neighbours: 16}\n").find("'colouring.neighbours'"), std::string::npos);
  EXPECT_EQ(said("colouring: {method: lens, neighbours: 15}\n"), "");
  EXPECT_NE(said("colouring: {method: lens}\ncloud: {crs: 'EPSG:99999999999999'}\n").find("'cloud.crs'"),
            std::string::npos);
}

}  // namespace
}  // namespace hueline::config
