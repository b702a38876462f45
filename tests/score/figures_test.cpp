#include <gmock/gmock.h>

#include <fstream>

#include "score/byte_account.hpp"
#include "score/comparison.hpp"
#include "score/flicker_figures.hpp"
#include "score/metric_table.hpp"
#include "score/motion_figures.hpp"
#include "score/plot.hpp"
#include "score/seam_figures.hpp"
#include "score/sheet_file.hpp"
#include "score/sheet_text.hpp"
#include "score/time_figures.hpp"
#include "score/view_figures.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::score {
namespace {

double value(const ScenarioScore& score, const char* metric) {
  const auto found = score.figures.find(metric);
  EXPECT_TRUE(found != score.figures.end() && found->second.value) << metric;
  return found != score.figures.end() ? found->second.value.value_or(-1) : -1;
}

TEST(TimeFigures, ByHand) {
  ScenarioScore score;
  // Errors of 1, -3, 2 and 10 us with a stated sigma of 2 us are 0.5, 1.5, 1 and 5 sigma.
  std::vector<ExposureError> errors{{0, 1, 2, true, {0.03, 0, 0.04}, 0.01},
                                    {1, -3, 2, true, {0, 0, 0}, 0.02},
                                    {2, 2, 2, false, {}, 0},
                                    {3, 10, 2, false, {}, 0}};
  add_time_figures(errors, 5, score);
  EXPECT_NEAR(value(score, "exposure_time_rms_us"), std::sqrt((1 + 9 + 4 + 100) / 4.0), 1e-12);
  EXPECT_EQ(value(score, "exposure_time_p99_us"), 10);
  EXPECT_EQ(value(score, "exposure_time_coverage_1s"), 0.5);
  EXPECT_EQ(value(score, "exposure_time_coverage_95"), 0.75);
  EXPECT_EQ(value(score, "exposure_time_coverage_3s"), 0.75);
  EXPECT_EQ(value(score, "exposures_stamped_share"), 0.8);
  EXPECT_NEAR(value(score, "pose_position_rms_m"), 0.05 / std::sqrt(2), 1e-12);
  EXPECT_NEAR(value(score, "pose_attitude_rms_deg"), std::sqrt(2.5e-4), 1e-12);
}

TEST(TimeFigures, WithoutASampleThereIsAReason) {
  ScenarioScore score;
  add_time_figures({}, 0, score);
  for (const auto& [metric, figure] : score.figures) {
    EXPECT_FALSE(figure.value) << metric;
    EXPECT_EQ(figure.reason, "the camera made no exposure");
  }
}

TEST(ByteAccount, EveryByteInOnePlace) {
  DeviceBytes d;
  d.sent_units = 10;
  d.sent_bytes = d.received_bytes = 1000;
  d.decoded = 700, d.ignored = 250, d.malformed = 50;
  EXPECT_EQ(unexplained_bytes(d), 0u);
  d.malformed = 47;
  EXPECT_EQ(unexplained_bytes(d), 3u);
  d.malformed = 55;
  EXPECT_EQ(unexplained_bytes(d), 5u) << "counted twice is as bad as not at all";
  d.malformed = 50;
  d.sent_units = 13, d.missing_units = 3, d.sent_bytes = 1300;
  EXPECT_EQ(unexplained_bytes(d), 300u) << "three packets vanished and nobody said so";
  d.told_lost = 2;
  EXPECT_EQ(unexplained_bytes(d), 100u);
  d.told_lost = 3;
  EXPECT_EQ(unexplained_bytes(d), 0u);
  const auto overtold = [](const DeviceBytes& device) {
    ScenarioScore score;
    add_byte_figures({{"laser", device}, {"pos", {}}}, score);
    return score.figures.at("overtold_units").value;
  };
  EXPECT_EQ(overtold(d), 0);
  d.told_lost = 5;
  EXPECT_EQ(unexplained_bytes(d), 0u);
  EXPECT_EQ(overtold(d), 2) << "who says five where three are missing has told of one twice";
}

Sheet sheet_of(std::map<std::string, Figure> figures) {
  ScenarioScore score;
  score.scenario = "street";
  score.figures = std::move(figures);
  return {score};
}
Verdict verdict(const char* metric, Figure before, Figure now) {
  const auto changes = compare(sheet_of({{metric, before}}), sheet_of({{metric, now}}));
  EXPECT_EQ(changes.size(), 1u);
  return changes[0].verdict;
}

TEST(Comparison, DirectionNoiseAndLostValues) {
  EXPECT_EQ(verdict("colour_de00_median", {2.0, {}}, {2.04, {}}), Verdict::Same);
  EXPECT_EQ(verdict("colour_de00_median", {2.0, {}}, {2.2, {}}), Verdict::Worse);
  EXPECT_EQ(verdict("colour_de00_median", {2.0, {}}, {1.8, {}}), Verdict::Better);
  EXPECT_EQ(verdict("coloured_share", {0.9, {}}, {0.89, {}}), Verdict::Worse);
  EXPECT_EQ(verdict("coloured_share", {0.9, {}}, {0.95, {}}), Verdict::Better);
  EXPECT_EQ(verdict("unexplained_bytes", {0.0, {}}, {1.0, {}}), Verdict::Worse);
  // A sigma that is too small is as wrong as one that is too large.
  EXPECT_EQ(verdict("exposure_time_coverage_95", {0.95, {}}, {0.85, {}}), Verdict::Worse);
  EXPECT_EQ(verdict("exposure_time_coverage_95", {0.5, {}}, {1.0, {}}), Verdict::Better);
  EXPECT_EQ(verdict("exposure_time_coverage_95", {0.97, {}}, {0.93, {}}), Verdict::Same);
  EXPECT_EQ(verdict("realtime_factor", {9.0, {}}, {1.0, {}}), Verdict::Informative)
      << "the clock on the wall never decides";
  EXPECT_EQ(verdict("hole_de00_ratio", {1.0, {}}, {{}, "gone"}), Verdict::Worse) << "a value that is none any more";
  EXPECT_EQ(verdict("hole_de00_ratio", {{}, "none"}, {{}, "none"}), Verdict::Same);
  EXPECT_EQ(verdict("hole_de00_ratio", {{}, "none"}, {3.0, {}}), Verdict::Informative);
  EXPECT_EQ(verdict("not_a_metric_any_more", {1.0, {}}, {9.0, {}}), Verdict::Informative);
}

TEST(Comparison, ASmallerSheetMayBeHeldAgainstALargerOne) {
  Sheet before = sheet_of({{"coloured_share", {0.9, {}}}});
  before.push_back(before[0]);
  before[1].scenario = "square";
  const auto changes = compare(before, sheet_of({{"coloured_share", {0.9, {}}}, {"placed_share", {1.0, {}}}}));
  ASSERT_EQ(changes.size(), 3u);
  EXPECT_EQ(changes[0].verdict, Verdict::Same);
  EXPECT_EQ(changes[1].verdict, Verdict::NotRun);
  EXPECT_EQ(changes[2].verdict, Verdict::Informative);
  EXPECT_EQ(changes[2].metric, "placed_share");
  EXPECT_NE(terminal_changes(changes).find("1 of scenarios not run"), std::string::npos);
}

TEST(SheetFile, ComesBackAsItWasWritten) {
  const auto path = std::filesystem::temp_directory_path() / ("hueline-score-" + std::to_string(::getpid()) + ".json");
  Sheet sheet = sheet_of(
      {{"coloured_share", {0.123456789, {}}}, {"hole_de00_ratio", {{}, "no hole"}}, {"unexplained_bytes", {0.0, {}}}});
  std::ofstream(path) << score_json(sheet);
  const auto back = read_score_json(path);
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->size(), 1u);
  EXPECT_EQ((*back)[0].scenario, "street");
  EXPECT_EQ((*back)[0].figures.size(), 3u);
  EXPECT_EQ((*back)[0].figures.at("coloured_share").value, 0.1234568);
  EXPECT_FALSE((*back)[0].figures.at("hole_de00_ratio").value);
  EXPECT_NE(notes_json(sheet, {}).find("\"hole_de00_ratio\": \"no hole\""), std::string::npos);
  for (const char* broken : {"", "[]", "{\"a\": 1}", "{\"a\": {\"b\": \"c\"}}", "{\"a\": {"}) {
    std::ofstream(path) << broken;
    const auto refused = read_score_json(path);
    ASSERT_FALSE(refused.ok()) << broken;
    EXPECT_EQ(refused.error().code, ErrorCode::Malformed);
  }
  std::filesystem::remove(path);
  EXPECT_EQ(read_score_json(path).error().code, ErrorCode::Io);
}

TEST(SeamFigures, AStepOfLightnessIsFoundUnderTextureAndNoise) {
  SeamFigures seams;
  std::uint32_t draw = 1;
  const auto noise = [&] {
    draw = draw * 1664525u + 1013904223u;
    return static_cast<double>(draw >> 8) / 16777216.0 - 0.5;
  };
  // A textured wall of 8 m x 2 m. Exposure 1 is 3 L* brighter than exposure 0; lens 1 of exposure 0 is 1 L* darker than
  // lens 0 of the same exposure.
  for (int i = 0; i < 60000; ++i) {
    const sim::Vec3 place{8 * (noise() + 0.5), 0.1, 2 * (noise() + 0.5)};
    const Lab truth{50 + 20 * noise(), 10 * noise(), 5 * noise()};
    const std::uint32_t exposure = i % 3 == 0 ? 1 : 0;
    const std::uint8_t lens = i % 3 == 1 ? 1 : 0;
    const Lab claimed =
        truth + Lab{4 * noise() + (exposure == 1 ? 3.0 : 0) - (lens == 1 ? 1.0 : 0), 4 * noise(), 4 * noise()};
    seams.add(place, 7, exposure, lens, claimed, truth);
  }
  ScenarioScore score;
  seams.report(score);
  // At L* = 50 one dE00 is one L*.
  EXPECT_NEAR(value(score, "exposure_seam_de00"), 3, 0.15);
  EXPECT_NEAR(value(score, "lens_seam_de00"), 1, 0.1);
  ScenarioScore none;
  SeamFigures().report(none);
  EXPECT_FALSE(none.figures.at("exposure_seam_de00").value);
  EXPECT_FALSE(none.figures.at("lens_seam_de00").reason.empty());
}

TEST(FlickerFigures, CountsWhatTextureDoesNotExplain) {
  // A wall with texture, coloured from two exposures in turn. One pair of neighbours in five has a step of 6 L* that is
  // not in the truth; the others show the texture alone.
  const auto p90 = [](double step, bool is_one_exposure) {
    FlickerFigures flicker;
    for (std::uint64_t i = 0; i < 40'000; ++i) {
      const sim::Vec3 place{0.1 * static_cast<double>(i / 2) + 0.05, 0.05, 0.05};
      const bool is_second = i % 2 == 1, is_stepped = i / 2 % 5 == 0;
      const Lab truth{is_second ? 55.0 : 45.0, 0, 0};
      const Lab claimed = truth + Lab{is_second && is_stepped ? step : 0.0, 0, 0};
      const std::uint32_t exposure = is_second && !is_one_exposure ? 5 : 4;
      flicker.add(place, 7, i, exposure, 0, claimed, truth);
      flicker.add(place, 7, i + 1'000'000, exposure, 0, Lab{0, 0, 0}, truth);  // a later point of the same source
    }
    ScenarioScore score;
    flicker.report(score);
    return score.figures.at("flicker_de00_p90");
  };
  EXPECT_LT(p90(0, false).value.value_or(9), 1e-5) << "texture is no flicker";
  EXPECT_NEAR(p90(6, false).value.value_or(-1), ciede2000({45, 0, 0}, {61, 0, 0}) - ciede2000({45, 0, 0}, {55, 0, 0}),
              0.1);
  EXPECT_LT(p90(-6, false).value.value_or(9), 1e-5) << "a texture that is washed out is none either";
  EXPECT_FALSE(p90(6, true).value) << "one exposure and one lens cannot flicker";
}

TEST(MotionFigures, ByHand) {
  MotionFigures motion;
  // Of 10 points on a car 6 are told moving, of 40 on the road 4.
  for (int i = 0; i < 10; ++i) motion.add(true, i < 6 ? (i < 3 ? 255 : 128) : (i < 8 ? 127 : 0));
  for (int i = 0; i < 40; ++i) motion.add(false, i < 4 ? 200 : 0);
  ScenarioScore score;
  motion.report(score);
  EXPECT_DOUBLE_EQ(value(score, "static_accuracy"), 0.9);
  EXPECT_DOUBLE_EQ(value(score, "dynamic_accuracy"), 0.6);
  EXPECT_DOUBLE_EQ(value(score, "associated_accuracy"), std::sqrt(0.54));
  MotionFigures still;
  still.add(false, 0);
  ScenarioScore without;
  still.report(without);
  EXPECT_EQ(value(without, "static_accuracy"), 1);
  EXPECT_FALSE(without.figures.at("dynamic_accuracy").value);
  EXPECT_FALSE(without.figures.at("associated_accuracy").value);
}

TEST(HeldOutFigures, OneFactorForALensIsNoErrorAndAColourIs) {
  const LabOfRgb lab(LabOfRgb::Encoding::Linear);
  // 400 greys in steps; every tenth pixel is predicted red. The image has twice the light.
  std::vector<HeldOutPixel> pixels;
  for (int i = 0; i < 400; ++i) {
    const auto grey = static_cast<std::uint8_t>(20 + i % 100);
    const auto twice = static_cast<std::uint8_t>(2 * grey);
    pixels.push_back({{grey, grey, grey}, {twice, twice, twice}});
    if (i % 10 == 0) pixels.back().predicted = {grey, 0, 0};
  }
  const auto figures = [&](std::span<const HeldOutPixel> view) {
    HeldOutFigures held_out(LabOfRgb::Encoding::Linear);
    held_out.add(view);
    ScenarioScore score;
    held_out.report(score);
    return score.figures;
  };
  EXPECT_LT(figures(pixels).at("held_out_de00_median").value.value_or(9), 1e-5) << "the factor of two is removed";
  EXPECT_NEAR(figures(pixels).at("held_out_within10_share").value.value_or(-1), 0.9, 1e-12);
  for (int i = 0; i < 400; ++i) pixels[static_cast<std::size_t>(i)].seen[2] = 0;  // another colour everywhere
  EXPECT_GT(figures(pixels).at("held_out_de00_median").value.value_or(0), 20);
  EXPECT_LT(figures(pixels).at("held_out_within10_share").value.value_or(1), 0.1);
  EXPECT_FALSE(figures(std::span(pixels).first(50)).at("held_out_de00_median").value) << "too few for the factor";
}

TEST(DepthEdgeFigures, ByHand) {
  ScenarioScore score;
  add_depth_edge_figures({.exposures = 2, .edges = 40, .missed = 10, .places = 160, .missed_there = 120}, score);
  EXPECT_EQ(value(score, "depth_edge_missed_share"), 0.25);
  EXPECT_EQ(value(score, "depth_edge_missed_share_by_chance"), 0.75);
  ScenarioScore none;
  add_depth_edge_figures({}, none);
  EXPECT_FALSE(none.figures.at("depth_edge_missed_share").value);
  EXPECT_FALSE(none.figures.at("depth_edge_missed_share_by_chance").reason.empty());
}

TEST(ViewFigures, ADriftIsNoticedAfterItAndFalseBeforeIt) {
  ScenarioScore none, drifted, missed;
  add_drift_figures({12.0}, {}, none);
  EXPECT_EQ(value(none, "drift_false_alarms"), 1);
  EXPECT_FALSE(none.figures.at("drift_noticed_s").value);
  add_drift_figures({12.0, 100.0, 120.0}, 75.0, drifted);
  EXPECT_EQ(value(drifted, "drift_false_alarms"), 1);
  EXPECT_EQ(value(drifted, "drift_noticed_s"), 25);
  add_drift_figures({}, 75.0, missed);
  EXPECT_EQ(value(missed, "drift_false_alarms"), 0);
  EXPECT_EQ(missed.figures.at("drift_noticed_s").reason, "the drift was not noticed");
  ScenarioScore unwatched;
  add_unwatched_drift_figures(unwatched);
  EXPECT_FALSE(unwatched.figures.at("drift_false_alarms").value);
}

TEST(MetricTable, NamesAreUniqueAndDocumented) {
  std::ifstream in(test::source_dir() / "docs/score.md");
  const std::string document{std::istreambuf_iterator<char>(in), {}};
  std::set<std::string> names;
  for (const Metric& metric : metrics()) {
    EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
    EXPECT_NE(document.find('`' + std::string(metric.name) + '`'), std::string::npos)
        << metric.name << " is not in docs/score.md";
    EXPECT_EQ(find_metric(metric.name), &metric);
  }
  // Programs of other people read these names.
  for (const char* name :
       {"exposure_time_rms_us",     "exposure_time_p99_us", "exposure_time_coverage_95", "pose_position_rms_m",
        "pose_attitude_rms_deg",    "reprojection_rms_px",  "reprojection_near_rms_px",  "coloured_share",
        "visible_coloured_share",   "wrong_surface_share",  "colour_de00_median",        "colour_de00_p95",
        "colour_de00_over20_share", "edge_smooth_ratio",    "exposure_seam_de00",        "lens_seam_de00",
        "hole_coloured_share",      "hole_de00_ratio",      "moving_contaminated_share", "unexplained_bytes",
        "latency_p99_ms",           "realtime_factor",      "points_per_second"})
    EXPECT_TRUE(names.contains(name)) << name;
}

TEST(Plot, TextIsEscapedAndEmptyChartsSaySo) {
  Chart chart{"<b> & \"c\"", "", "", Chart::Kind::Lines, true, {}, {}};
  EXPECT_THAT(svg(chart), testing::AllOf(testing::HasSubstr("&lt;b&gt; &amp; &quot;c&quot;"),
                                         testing::HasSubstr("nothing to show")));
  chart.curves.push_back({"", {{0.0, 1.0}, {10.0, 2.0}}, {}});
  EXPECT_THAT(svg(chart), testing::Not(testing::AnyOf(testing::HasSubstr("nan"), testing::HasSubstr("inf"))))
      << "a zero on a logarithmic axis";
  chart.curves[0].points = {{5, 5}};
  EXPECT_THAT(svg(chart), testing::Not(testing::AnyOf(testing::HasSubstr("nan"), testing::HasSubstr("inf"))));
}

}  // namespace
}  // namespace hueline::score
