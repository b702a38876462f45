#include "survey/some_moments.hpp"

#include <gtest/gtest.h>

namespace hueline::survey {
namespace {

TEST(SomeMoments, CamerasOfOneMomentAreChosenTogether) {
  SomeMoments some(4, std::chrono::milliseconds(5));
  std::vector<int> chosen;
  for (int i = 0; i < 12; ++i) {
    const GpsTime mid = gps_time_ns(1'000'000'000'000) + std::chrono::milliseconds(100 * i);
    const bool is_chosen = some.chooses(mid);
    EXPECT_EQ(some.chooses(mid + std::chrono::milliseconds(2)), is_chosen) << "the second camera of moment " << i;
    if (is_chosen) chosen.push_back(i);
  }
  EXPECT_EQ(chosen, (std::vector<int>{2, 6, 10}));
}

TEST(SomeMoments, OneInOneIsAll) {
  SomeMoments some(1, std::chrono::milliseconds(5));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(some.chooses(gps_time_ns(1'000'000'000ll * i)));
}

}  // namespace
}  // namespace hueline::survey
