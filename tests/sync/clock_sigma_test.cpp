#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/clock_course.hpp"

/// Compares the stated sigma with the error that it describes, over simulated hours.
namespace hueline::sync {
namespace {

using namespace hueline::test;
using std::chrono::hours;

struct NoiseCase {
  const char* name;
  double jitter_us;
  Oscillator::Form form;
  bool dropouts;
};
class SigmaIsTrue : public testing::TestWithParam<NoiseCase> {};

TEST_P(SigmaIsTrue, OverHours) {
  const NoiseCase c = GetParam();
  Drive drive(some_begin(), hours(3), c.form, 11);
  const GpsTime begin = drive.begin;
  drive.pps(gaussian(c.jitter_us), [&](GpsTime t) {
    const auto s = std::chrono::duration_cast<seconds>(t - begin).count();
    return c.dropouts && (s % 613 > 560 || s % 37 == 5);  // 52 s without edges, and single lost ones
  });
  drive.labels(kPos, late(30, 20));
  drive.ins(5, late(4, 2));
  Course run(drive, clock_config());
  // After ten minutes, all properties of the clock have been measured.
  std::vector<double> normalised, holdover;
  for (const auto& s : run.samples)
    if (s.truth > begin + seconds(600) && s.can_stamp)
      (s.state == SyncState::Holdover ? holdover : normalised).push_back(s.normalised());
  const auto rms = [](const std::vector<double>& v) {
    double sum = 0;
    for (const double x : v) sum += x * x;
    return std::sqrt(sum / static_cast<double>(v.size()));
  };
  const auto inside = [](const std::vector<double>& v, double limit) {
    return static_cast<double>(std::count_if(v.begin(), v.end(), [&](double x) { return std::abs(x) < limit; })) /
           static_cast<double>(v.size());
  };
  ASSERT_GT(normalised.size(), 80'000u);
  RecordProperty("rms", std::to_string(rms(normalised)));
  std::printf("%s: locked rms %.2f, within 1/2/3 sigma %.3f %.3f %.4f; sigma %.2f us; holdover n %zu rms %.2f\n",
              c.name, rms(normalised), inside(normalised, 1), inside(normalised, 2), inside(normalised, 3),
              static_cast<double>(run.samples.back().stamp->sigma.count()) * 1e-3, holdover.size(),
              holdover.empty() ? 0 : rms(holdover));
  EXPECT_GT(rms(normalised), 0.6);
  EXPECT_LT(rms(normalised), 1.25);
  EXPECT_GT(inside(normalised, 1), 0.58);
  EXPECT_LT(inside(normalised, 1), 0.92);
  EXPECT_GT(inside(normalised, 2), 0.90);
  EXPECT_GT(inside(normalised, 3), 0.985);
  if (c.dropouts) {
    ASSERT_GT(holdover.size(), 3000u);
    EXPECT_GT(inside(holdover, 3), 0.95);
    EXPECT_LT(rms(holdover), 1.6);
  }
}

INSTANTIATE_TEST_SUITE_P(Noise, SigmaIsTrue,
                         testing::Values(NoiseCase{"quiet", 1, {12, 0.02, 0.3, 0, 0, 900}, false},
                                         NoiseCase{"ordinary", 5, {-30, 0.05, 2, 0, 0, 900}, false},
                                         NoiseCase{"usb_pps", 200, {12, 0.05, 2, 0, 0, 900}, false},
                                         NoiseCase{"wandering", 2, {12, 0.5, 10, 0, 0, 900}, false},
                                         NoiseCase{"warming", 5, {12, 0.05, 1, 0.5, 1, 1200}, false},
                                         NoiseCase{"dropouts", 5, {12, 0.05, 2, 0, 0, 900}, true}),
                         [](const auto& each) { return std::string(each.param.name); });

}  // namespace
}  // namespace hueline::sync
