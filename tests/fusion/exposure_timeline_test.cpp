// Which moments may serve a point, at different rates of the camera.
#include "fusion/exposure_timeline.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hueline::fusion {
namespace {

/// Adds moments every `interval` from 0 to `end`, each with a picture of one camera.
ExposureTimeline moments(nanoseconds interval, nanoseconds end) {
  ExposureTimeline timeline({.interval_at_start = interval}, 1);
  for (nanoseconds t{0}; t <= end; t += interval) {
    Exposure exposure;
    exposure.exposure_mid = GpsTime(t);
    timeline.add(exposure, 0, {});
  }
  return timeline;
}

/// Returns how much earlier (negative) or later than `t` the neighbours of `t` are, in ms.
std::vector<int> neighbours_ms(const ExposureTimeline& timeline, GpsTime t, nanoseconds reach) {
  std::vector<int> found;
  timeline.neighbours_of(t, reach, 8, 3, -1, found);
  std::vector<int> out;
  for (const int index : found) out.push_back(static_cast<int>((timeline.at(index).time - t).count() / 1'000'000));
  return out;
}

TEST(ExposureTimeline, BeyondTheNearestThreeStepsServeAPoint) {
  using std::chrono::milliseconds, std::chrono::seconds;
  const ExposureTimeline timeline = moments(milliseconds(100), seconds(10));
  EXPECT_EQ(timeline.step(), milliseconds(400));
  EXPECT_EQ(neighbours_ms(timeline, GpsTime(milliseconds(5040)), milliseconds(2000)),
            (std::vector<int>{-40, 60, -140, 160, -240, 260, 560, -640, 960, -1040, 1360, -1440, 1760, -1840}))
      << "the moments of 4.4 s, 4.0 s ... and of 5.6 s, 6.0 s ... are steps";
}

TEST(ExposureTimeline, EveryMomentOfASlowCameraIsAStep) {
  using std::chrono::milliseconds, std::chrono::seconds;
  const ExposureTimeline timeline = moments(milliseconds(500), seconds(20));
  EXPECT_EQ(timeline.step(), milliseconds(500));
  const auto found = neighbours_ms(timeline, GpsTime(milliseconds(10100)), seconds(60));
  ASSERT_EQ(found.size(), 16u);
  EXPECT_EQ(found.back(), 3900);
}

TEST(ExposureTimeline, OnlyStepsAreHeldForLong) {
  using std::chrono::milliseconds, std::chrono::seconds;
  ExposureTimeline timeline = moments(milliseconds(100), seconds(10));
  const auto before = neighbours_ms(timeline, GpsTime(milliseconds(9540)), seconds(4));
  timeline.keep_steps_before(GpsTime(milliseconds(9200)));
  EXPECT_EQ(timeline.size(), 23u + 9u);  // 0, 0.4 ... 8.8 s, and 9.2 to 10 s
  EXPECT_EQ(neighbours_ms(timeline, GpsTime(milliseconds(9540)), seconds(4)), before);
  timeline.forget_before(GpsTime(seconds(5)));
  EXPECT_EQ(timeline.at(0).time, GpsTime(milliseconds(5200)));
}

}  // namespace
}  // namespace hueline::fusion
