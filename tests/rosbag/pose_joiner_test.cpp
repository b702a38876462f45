// Orientations and positions that come in another order than they were measured in.
#include <gtest/gtest.h>

#include <vector>

#include "drivers/ros/ros_pose_joiner.hpp"

namespace hueline {
namespace {

using drivers::RosOrientation;
using drivers::RosPoseJoiner;
using drivers::RosPosition;
using std::chrono::milliseconds;

UnixTime at_ms(std::int64_t ms) { return UnixTime(std::chrono::seconds(1'700'000'000) + milliseconds(ms)); }
RosOrientation turned(std::int64_t ms) { return {at_ms(ms), Eigen::Quaterniond::Identity()}; }
/// The vehicle climbs 1 m/s.
RosPosition placed(std::int64_t ms) { return {at_ms(ms), {0.8, 0.2, 100 + static_cast<double>(ms) / 1000}, {}}; }

/// What came out, in ms.
struct Came {
  std::vector<std::int64_t> ms;
  void take_from(RosPoseJoiner& joiner) {
    while (const auto one = joiner.next()) {
      const nanoseconds since = one->orientation.time - at_ms(0);
      EXPECT_NEAR(one->position.place.ellipsoidal_height, 100 + to_seconds(since), 1e-6);
      EXPECT_NEAR(one->velocity_enu.z(), 1, 1e-6);
      ms.push_back(since / milliseconds(1));
    }
  }
};

TEST(RosPoseJoiner, WaitsForOrientationsThatComeBehindALaterPosition) {
  RosPoseJoiner joiner;
  Came came;
  std::vector<std::int64_t> wanted;
  for (std::int64_t ms = 0; ms <= 10'000; ms += 10) {
    // A position takes 2 ms to the recorder, an orientation 36 ms.
    if (ms % 100 == 0) {
      EXPECT_TRUE(joiner.add(placed(ms), at_ms(ms + 2)));
    }
    if (ms >= 30) {
      EXPECT_TRUE(joiner.add(turned(ms - 30), at_ms(ms + 6)));
      wanted.push_back(ms - 30);
    }
    came.take_from(joiner);
  }
  EXPECT_GT(came.ms.size(), 880u) << "no more than the patience waits";
  joiner.end();
  came.take_from(joiner);
  EXPECT_EQ(came.ms, wanted);
  EXPECT_EQ(joiner.unplaced(), 0u);
}

TEST(RosPoseJoiner, GivesInTheOrderOfTimeWhateverTheOrderOfTheInput) {
  RosPoseJoiner joiner;
  Came came;
  for (const int ms : {300, 100, 200, 400, 50}) EXPECT_TRUE(joiner.add(turned(ms), at_ms(500)));
  EXPECT_FALSE(joiner.add(turned(200), at_ms(500))) << "there is one of its time";
  for (const int ms : {1000, 0}) EXPECT_TRUE(joiner.add(placed(ms), at_ms(1000)));
  EXPECT_TRUE(joiner.add(placed(2000), at_ms(2000)));
  came.take_from(joiner);
  EXPECT_EQ(came.ms, (std::vector<std::int64_t>{50, 100, 200, 300, 400}));
  EXPECT_FALSE(joiner.add(turned(350), at_ms(2000))) << "a later one was given";
  EXPECT_TRUE(joiner.add(turned(450), at_ms(2000)));
  joiner.end();
  came.take_from(joiner);
  EXPECT_EQ(came.ms.back(), 450);
}

TEST(RosPoseJoiner, KnowsNoPlaceFarFromPositions) {
  RosPoseJoiner joiner;
  Came came;
  for (const int ms : {0, 1000, 6000, 7000}) EXPECT_TRUE(joiner.add(placed(ms), at_ms(ms)));
  for (const int ms : {-5, 0, 500, 3000, 6500, 7001}) EXPECT_TRUE(joiner.add(turned(ms), at_ms(7000)));
  joiner.end();
  came.take_from(joiner);
  EXPECT_EQ(came.ms, (std::vector<std::int64_t>{0, 500, 6500}));
  EXPECT_EQ(joiner.unplaced(), 3u);
}

TEST(RosPoseJoiner, KeepsNoMoreThanItsBoundWithoutPositions) {
  RosPoseJoiner joiner;
  const std::int64_t all = RosPoseJoiner::kMost + 100;
  // The recorder's clock stands, so nothing is ever late.
  for (std::int64_t ms = 0; ms < all; ++ms) {
    EXPECT_TRUE(joiner.add(turned(ms), at_ms(0)));
    EXPECT_FALSE(joiner.next());
  }
  EXPECT_EQ(joiner.unplaced(), 100u);
}

}  // namespace
}  // namespace hueline
