// Captures of real receivers beside gpsd's decoding of them (the .chk file next to each): time, position and fix.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/nmea/nmea_decoder.hpp"
#include "drivers/ublox/ublox_decoder.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using namespace test;

/// A report of gpsd.
struct Report {
  int mode = 0, status = 0;  // mode 3: a position in space; status: gpsd's kind of fix
  std::optional<double> latitude, longitude, height;
};

Bytes read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(in), {});
}

/// gpsd's reports by their time of UTC, to a hundredth of a second. gpsd repeats a report with more values when more
/// sentences of the epoch have come.
std::multimap<std::string, Report> reports(const std::filesystem::path& path) {
  std::multimap<std::string, Report> out;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (json.is_discarded() || json.value("class", "") != "TPV" || !json.contains("time")) continue;
    Report report{json.value("mode", 0), json.value("status", 1), {}, {}, {}};
    if (json.contains("lat")) report.latitude = json["lat"].get<double>();
    if (json.contains("lon")) report.longitude = json["lon"].get<double>();
    if (json.contains("altHAE")) report.height = json["altHAE"].get<double>();
    out.emplace(json["time"].get<std::string>().substr(0, 22), report);
  }
  return out;
}

bool is_same_kind(FixType type, int status) {
  switch (status) {
    case 2:
      return type == FixType::Dgnss;
    case 3:
      return type == FixType::RtkFixed;
    case 4:
      return type == FixType::RtkFloat;
    default:
      return type == FixType::Single;
  }
}

struct Compared {
  int fixes = 0, with_report = 0, other_kind = 0;
  double plane_m = 0, height_m = 0;  // greatest differences
};

/// Compares each fix with the report of the same time that is nearest to it.
template <class Device>
Compared compare(const std::filesystem::path& path) {
  Device decoder({});
  const Bytes bytes = read(path);
  const Heard heard = hear(decoder, bytes);
  EXPECT_EQ(heard.bytes(), bytes.size());
  const auto known = reports(path.string() + ".chk");
  Compared out;
  for (const GnssFix& fix : heard.all<GnssFix>()) {
    ++out.fixes;
    // Receivers solve a fraction of a millisecond beside the full hundredth, which gpsd rounds.
    const std::string time = iso_utc(fix.time + std::chrono::milliseconds(4)).substr(0, 22);
    const auto [begin, end] = known.equal_range(time);
    if (begin == end) continue;
    ++out.with_report;
    double least = 1e9, height = 0;
    bool is_kind = false;
    for (auto at = begin; at != end; ++at) {
      const Report& report = at->second;
      if (report.mode >= 2) is_kind |= is_same_kind(fix.type, report.status);
      if (report.mode < 2) is_kind |= fix.type == FixType::None;
      if (!report.latitude || !report.longitude || fix.type == FixType::None) continue;
      const double north = (fix.position.latitude * kDegPerRad - *report.latitude) * 111'200;
      const double east =
          (fix.position.longitude * kDegPerRad - *report.longitude) * 111'200 * std::cos(fix.position.latitude);
      if (std::hypot(north, east) >= least) continue;
      least = std::hypot(north, east);
      height = report.height ? std::abs(*report.height - fix.position.ellipsoidal_height) : 0;
    }
    out.other_kind += !is_kind;
    if (least < 1e9) {
      out.plane_m = std::max(out.plane_m, least);
      out.height_m = std::max(out.height_m, height);
    }
  }
  std::printf(
      "%s: %d fixes, %d with a report of gpsd, %d of another kind; differences %.4f m in the plane, %.4f m up\n",
      path.filename().c_str(), out.fixes, out.with_report, out.other_kind, out.plane_m, out.height_m);
  return out;
}

struct Capture {
  const char* file;
  bool is_nmea;
  int fixes, reported;  // gpsd is silent about the first epoch when it has not recognised the receiver yet
  double plane_m, height_m;
};
class Gpsd : public testing::TestWithParam<Capture> {};

TEST_P(Gpsd, AgreesOnTimePositionAndFix) {
  const Capture capture = GetParam();
  HUELINE_REQUIRE_DATA(std::string("gnss/") + capture.file);
  const Compared compared = capture.is_nmea ? compare<NmeaDecoder>(data_file) : compare<UbloxDecoder>(data_file);
  EXPECT_EQ(compared.fixes, capture.fixes);
  EXPECT_EQ(compared.with_report, capture.reported);
  EXPECT_EQ(compared.other_kind, 0);
  EXPECT_LT(compared.plane_m, capture.plane_m);
  EXPECT_LT(compared.height_m, capture.height_m);
}

// gpsd prints a billionth of a degree. Of the F9R it reports the NMEA sentences, which have 0.00001 minutes and 0.1 m.
INSTANTIATE_TEST_SUITE_P(Captures, Gpsd,
                         testing::Values(Capture{"nmea-rtk.log", true, 122, 122, 0.001, 0.001},
                                         Capture{"ublox-8-time.log", false, 89, 89, 0.001, 0.001},
                                         Capture{"ublox-f9p-hpnmea.log", true, 9, 9, 0.001, 0.001},
                                         Capture{"ublox-neo-m8t-s.log", false, 29, 29, 0.001, 0.001},
                                         Capture{"ublox-zed-f9p-hp.log", false, 29, 28, 0.001, 0.001},
                                         Capture{"ublox-zed-f9r.log", false, 30, 29, 0.019, 0.1}),
                         [](const auto& capture) {
                           std::string name = capture.param.file;
                           std::erase_if(name, [](char c) { return c == '-' || c == '.'; });
                           return name;
                         });

}  // namespace
}  // namespace hueline::drivers
