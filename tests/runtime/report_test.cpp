#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "core/output_file.hpp"
#include "runtime/report_content.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::runtime {
namespace {

/// A report that a PDF reader of other people (poppler) reads.
class Printed {
 public:
  explicit Printed(const ReportContent& content) {
    EXPECT_TRUE(write_output(folder_ / "report.pdf", report_pdf(content)).ok());
  }
  std::string text() const { return said("pdftotext -raw report.pdf -"); }
  std::string facts() const { return said("pdfinfo report.pdf"); }

  struct Word {
    double left, top, right, bottom;
    std::string text;
  };
  std::vector<Word> words() const {
    std::vector<Word> out;
    const std::string all = said("pdftotext -bbox report.pdf -");
    const std::regex form(R"re(<word xMin="(.*)" yMin="(.*)" xMax="(.*)" yMax="(.*)">(.*)</word>)re");
    for (std::sregex_iterator it(all.begin(), all.end(), form), end; it != end; ++it)
      out.push_back({std::stod((*it)[1]), std::stod((*it)[2]), std::stod((*it)[3]), std::stod((*it)[4]), (*it)[5]});
    return out;
  }
  /// Returns how many pixels of a picture with 72 pixels an inch have nearly this colour.
  std::size_t pixels(int red, int green, int blue) const {
    const std::string ppm = said("pdftoppm -r 72 report.pdf");
    std::size_t out = 0;
    const auto near = [&](std::size_t at, int wanted) {
      return std::abs(static_cast<int>(static_cast<unsigned char>(ppm[at])) - wanted) < 24;
    };
    for (std::size_t at = ppm.find("255\n") + 4; at + 2 < ppm.size(); at += 3)
      if (near(at, red) && near(at + 1, green) && near(at + 2, blue)) ++out;
    return out;
  }

 private:
  std::string said(const std::string& command) const {
    std::string out;
    std::FILE* pipe = ::popen(fmt::format("cd '{}' && {} 2>&1", folder_.path().string(), command).c_str(), "r");
    if (pipe == nullptr) return out;
    std::array<char, 65536> part{};
    for (std::size_t got = 0; (got = std::fread(part.data(), 1, part.size(), pipe)) > 0;) out.append(part.data(), got);
    EXPECT_EQ(::pclose(pipe), 0) << command << ": " << out.substr(0, 200);
    return out;
  }
  const test::TemporaryFolder folder_;
};

std::string without_spaces(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\n' || c == '\f'; });
  return text;
}

ReportContent drive() {
  ReportContent out;
  out.rig = "street car (2)";
  out.grade = Grade::Remarks;
  auto& map = out.map.emplace();
  map.px_per_m = 0.5;
  map.paths = {{ReportContent::Line::Coloured, {{30, 190}, {300, 60}}},
               {ReportContent::Line::Colourless, {{300, 60}, {500, 60}}},
               {ReportContent::Line::Empty, {{500, 60}, {690, 350}}},
               {ReportContent::Line::Driven, {{690, 350}, {600, 350}}}};
  map.weak = {{310, 60}, {318, 60}};
  map.remarks = {{{500, 60}, 1}, {{502, 61}, 2}};
  map.marks = {{{300, 60}, 1}};
  out.reasons = {{Grade::Again, "laser", "no points for 12.0 s", " (2026-05-04T10:00:12.000Z, 12 s, 80 m, 48.1 11.5)"},
                 {Grade::Remarks, "pos", "pose sigma 0.084 m at worst, above the rig's 0.05 m", " (11 s, 77 m)"}};
  out.marks = {{"M1", "2026-05-04T10:00:20.000Z, 48.137154 11.576124", "bump \u2713 路口"}};
  out.figures = {
      {"Drive", "2026-05-04T10:00:00.000Z to 2026-05-04T11:00:00.000Z, 3600 s, 24100 m", ""},
      {"Coverage", "910000000 points in 3588 s; 12 s without points", ""},
      {"Time", "7200 exposures, 7200 by event mark, 0 unmatched; sigma 1.2 us rms, 9.9 us largest", "50 us"}};
  return out;
}

/// Adds reasons and marks, more than a page holds.
ReportContent long_drive() {
  ReportContent out = drive();
  for (int i = 0; i < 60; ++i)
    out.reasons.push_back({Grade::Remarks, fmt::format("sensor_{}", i),
                           "without images for 64.0 s, more than the rig's 5.0 s, and that again and again on this way",
                           " (2026-05-04T10:00:12.000Z, 64 s, 498 m, 48.137154 11.576124)"});
  for (int i = 0; i < 300; ++i) out.marks.push_back({fmt::format("M{}", i + 2), "12.0 s", "a note"});
  return out;
}

TEST(Report, BothFormsSayTheSameOnOnePageOfA4) {
  const ReportContent content = drive();
  const Printed pdf(content);
  EXPECT_THAT(pdf.facts(), testing::ContainsRegex("Pages: +1\n"));
  EXPECT_THAT(pdf.facts(), testing::ContainsRegex("Page size: +595.28 x 841.89 pts \\(A4\\)"));
  EXPECT_THAT(pdf.facts(), testing::ContainsRegex("Title: +Drive of street car \\(2\\): usable with remarks"));
  const std::string printed = without_spaces(pdf.text()), page = without_spaces(report_html(content));
  const auto says = [&](const std::string& words) {
    EXPECT_THAT(printed, testing::HasSubstr(without_spaces(words)));
    EXPECT_THAT(page, testing::HasSubstr(without_spaces(words)));
  };
  says(content.rig);
  says("usable with remarks");
  for (const auto& one : content.reasons) {
    says(one.sensor);
    says(": " + one.text + one.when);
  }
  for (const auto& one : content.figures) {
    says(one.what);
    says(one.measured);
    says(one.wanted);
  }
  says(content.marks[0].where);
  says("路口");
  // What has no shape is named.
  EXPECT_THAT(printed, testing::HasSubstr("bump\\u{2713}路口"));
  EXPECT_THAT(printed, testing::HasSubstr("200m"));
  EXPECT_THAT(printed, testing::Not(testing::HasSubstr("more in")));
}

TEST(Report, TheMapAndTheVerdictHaveTheirColours) {
  const Printed pdf(drive());
  EXPECT_GT(pdf.pixels(18, 129, 63), 200u) << "coloured";
  EXPECT_GT(pdf.pixels(217, 130, 0), 100u) << "too few colours";
  EXPECT_GT(pdf.pixels(192, 0, 28), 50u) << "no points";
  EXPECT_GT(pdf.pixels(150, 92, 0), 10'000u) << "the verdict";
  ReportContent again = drive();
  again.grade = Grade::Again;
  again.map.reset();
  const Printed without(again);
  EXPECT_GT(without.pixels(161, 0, 24), 10'000u);
  EXPECT_LT(without.pixels(18, 129, 63), 5u);
  EXPECT_THAT(without.text(), testing::HasSubstr(kNoMap));
}

TEST(Report, ALongListIsCutAndSaysSo) {
  const ReportContent content = long_drive();
  const Printed pdf(content);
  EXPECT_THAT(pdf.facts(), testing::ContainsRegex("Pages: +1\n"));
  const std::string text = pdf.text();
  EXPECT_THAT(text, testing::ContainsRegex("and [0-9]+ more in summary.json"));
  EXPECT_THAT(without_spaces(text), testing::HasSubstr(without_spaces(content.figures.back().measured)));
  // What is counted and what is listed are all.
  std::smatch more;
  ASSERT_TRUE(std::regex_search(text, more, std::regex("and ([0-9]+) more in summary.json")));
  std::size_t listed = 2;
  for (int i = 0; i < 60; ++i) listed += text.find(fmt::format("sensor_{}:", i)) != std::string::npos ? 1 : 0;
  EXPECT_EQ(std::stoul(more[1]) + listed, content.reasons.size());
  ReportContent some = drive();
  some.marks = content.marks;
  some.marks.resize(38);
  EXPECT_THAT(Printed(some).text(), testing::ContainsRegex("and [0-9]+ more in report.html"));
}

TEST(Report, NothingLiesOnOtherWordsOrOutsideThePage) {
  ReportContent crowded = long_drive();
  crowded.rig = std::string(200, 'W');
  crowded.reasons[0].text = std::string(3000, 'x');
  crowded.marks[0].note = std::string(500, 'W') + " 路口" + std::string(900, '(');
  crowded.figures[1].measured = std::string(400, '9');
  for (std::size_t i = 0; i < 12; ++i)
    crowded.map->remarks.push_back({{500 + 0.1 * static_cast<double>(i), 60}, i + 1});
  for (const ReportContent& content : {drive(), long_drive(), crowded, ReportContent{}}) {
    const auto words = Printed(content).words();
    EXPECT_GT(words.size(), 5u);
    for (std::size_t i = 0; i < words.size(); ++i) {
      const auto& a = words[i];
      EXPECT_TRUE(a.left > 30 && a.right < 566 && a.top > 30 && a.bottom < 826) << a.text;
      for (std::size_t k = 0; k < i; ++k) {
        const auto& b = words[k];
        // Poppler's boxes are as high as the font, a little more than the distance of lines.
        const double wide = std::min(a.right, b.right) - std::max(a.left, b.left);
        const double high = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
        EXPECT_FALSE(wide > 0.5 && high > 3) << a.text << " lies on " << b.text;
      }
    }
  }
}

TEST(Report, AnyTextMakesOnePage) {
  std::mt19937 random(1);
  const auto any = [&] {
    std::string out(random() % 400, ' ');
    for (char& c : out) c = static_cast<char>(random() % 3 == 0 ? "()\\<>/%\n "[random() % 9] : random());
    return out;
  };
  for (int i = 0; i < 10; ++i) {
    ReportContent content = long_drive();
    content.rig = any();
    for (auto& one : content.reasons) one.sensor = any(), one.text = any();
    for (auto& one : content.marks) one.note = any();
    for (auto& one : content.figures) one.measured = any(), one.wanted = any();
    EXPECT_EQ(report_pdf(content), report_pdf(content));
    EXPECT_THAT(Printed(content).facts(), testing::ContainsRegex("Pages: +1\n"));
  }
}

TEST(Report, TheMapHasTheClassesOfTheDrive) {
  const config::Rig rig = config::parse_rig(
      "rig: r\nsensors:\n  - {name: pps, driver: pps, device: /dev/pps0}\n"
      "  - {name: pos, driver: novatel, tcp: {host: h, port: 3001}, logs: {}}\ncolouring: {method: lens}\n",
      "rig");
  DriveMap map;
  for (int second = 0; second < 40; ++second) {
    InsSolution solution;
    solution.sensor = 2;
    solution.time = from_gps_week(2400, from_seconds(100 + second));
    solution.position = {0.84 + 1e-6 * second, 0.2, 570};
    solution.is_good = true;
    map.on_solution(solution);
    CloudBlock block;
    if (second >= 10 && second < 30 && second / 5 != 4) block.points.resize(100);
    for (ColouredPoint& point : block.points) point.time = solution.time;
    map.on_cloud(block);
  }
  Verdict verdict;
  verdict.remarks.resize(2);
  verdict.remarks[1].place = Geodetic{0.84, 0.2, 570};
  const ReportContent content = report_content(rig, verdict, Summary(rig.sensor_names()), map);
  ASSERT_TRUE(content.map);
  std::vector<ReportContent::Line> lines;
  for (const auto& path : content.map->paths) lines.push_back(path.line);
  using Line = ReportContent::Line;
  EXPECT_EQ(lines, (std::vector{Line::Driven, Line::Coloured, Line::Empty, Line::Coloured, Line::Driven}));
  ASSERT_EQ(content.map->remarks.size(), 1u);
  EXPECT_EQ(content.map->remarks[0].number, 2u) << "the number is that of the list";
  EXPECT_GT(content.map->paths.front().places.front().y, content.map->paths.back().places.back().y) << "north is up";
  EXPECT_FALSE(report_content(rig, verdict, Summary(rig.sensor_names()), DriveMap()).map);
}

}  // namespace
}  // namespace hueline::runtime
