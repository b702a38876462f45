#include "core/calendar.hpp"

#include <gtest/gtest.h>

namespace hueline {
namespace {

using std::chrono::seconds;

TEST(Calendar, KnownInstants) {
  // 2017-01-01T00:00:00 UTC = GPS week 1930, second 18 of the week (public leap-second tables).
  EXPECT_EQ(from_utc({2017, 1, 1, 0, 0, 0, 0}), from_gps_week(1930, seconds(18)));
  // Unix 1700000000 = 2023-11-14T22:13:20Z; GPS = Unix - 315964800 + 18.
  EXPECT_EQ(from_utc({2023, 11, 14, 22, 13, 20, 0}), GpsTime(seconds(1700000000LL - 315964800 + 18)));
  EXPECT_EQ(iso_utc(GpsTime(seconds(1700000000LL - 315964800 + 18)) + nanoseconds(250'000'000)),
            "2023-11-14T22:13:20.250Z");
}

TEST(Calendar, WeekRoundTripAcrossWeekEnd) {
  const GpsTime last = from_gps_week(2345, seconds(kSecondsPerWeek) - nanoseconds(1));
  EXPECT_EQ(to_gps_week(last).week, 2345);
  EXPECT_EQ(to_gps_week(last + nanoseconds(1)).week, 2346);
  EXPECT_EQ(to_gps_week(last + nanoseconds(1)).time_of_week.count(), 0);
}

TEST(Calendar, LeapSecondIsSecondSixty) {
  const GpsTime leap = *from_utc({2016, 12, 31, 23, 59, 60, 0});
  EXPECT_EQ(leap, *from_utc({2016, 12, 31, 23, 59, 59, 0}) + seconds(1));
  EXPECT_EQ(leap + seconds(1), *from_utc({2017, 1, 1, 0, 0, 0, 0}));
  EXPECT_EQ(to_utc(leap), (UtcTime{2016, 12, 31, 23, 59, 60, 0}));
  EXPECT_EQ(to_utc(leap + seconds(1)), (UtcTime{2017, 1, 1, 0, 0, 0, 0}));
  EXPECT_EQ(utc_offset_from_table(leap), seconds(17));
  EXPECT_EQ(utc_offset_from_table(leap + seconds(1)), seconds(18));
}

TEST(Calendar, RoundTripEveryFewDaysOfFortyYears) {
  for (std::int64_t s = 0; s < 40LL * 366 * 86400; s += 263'457) {
    const GpsTime t(seconds(s) + nanoseconds(123'456'789));
    ASSERT_EQ(from_utc(to_utc(t)), t) << s;
  }
}

TEST(Calendar, RefusesWhatIsNoDate) {
  EXPECT_FALSE(from_utc({2023, 2, 29, 0, 0, 0, 0}));
  EXPECT_FALSE(from_utc({2023, 13, 1, 0, 0, 0, 0}));
  EXPECT_FALSE(from_utc({2023, 1, 1, 24, 0, 0, 0}));
  EXPECT_FALSE(from_utc({1979, 1, 1, 0, 0, 0, 0}));
}

TEST(Calendar, UnixTimeAndBack) {
  EXPECT_EQ(from_unix(UnixTime(seconds(1'700'000'000))), *from_utc({2023, 11, 14, 22, 13, 20, 0}));
  EXPECT_EQ(to_unix(*from_utc({2016, 12, 31, 23, 59, 59, 500})), UnixTime(seconds(1'483'228'799) + nanoseconds(500)));
  EXPECT_EQ(to_unix(*from_utc({2016, 12, 31, 23, 59, 60, 0})), to_unix(*from_utc({2017, 1, 1, 0, 0, 0, 0})));
  EXPECT_EQ(from_unix(UnixTime(seconds(1'483'228'800))), *from_utc({2017, 1, 1, 0, 0, 0, 0}));
  EXPECT_EQ(from_unix(UnixTime(seconds(1'700'000'000)), seconds(19)) - from_unix(UnixTime(seconds(1'700'000'000))),
            seconds(1));
}

/// TAI was 36 s ahead of UTC until the end of 2016, and is 37 s ahead since.
TEST(Calendar, TaiIsAheadOfUtcByTheLeapSecondsAndTen) {
  EXPECT_EQ(unix_of_tai(seconds(1'483'228'800 - 1 + 36)), UnixTime(seconds(1'483'228'799)));
  EXPECT_EQ(unix_of_tai(seconds(1'483'228'800 + 37) + nanoseconds(5)),
            UnixTime(seconds(1'483'228'800) + nanoseconds(5)));
  EXPECT_EQ(unix_of_tai(seconds(315'964'800 + 19)), to_unix(GpsTime{}));
}

TEST(Calendar, ReceiversOffsetOutranksTheTable) {
  EXPECT_EQ(*from_utc({2030, 1, 1, 0, 0, 0, 0}, seconds(19)) - *from_utc({2030, 1, 1, 0, 0, 0, 0}), seconds(1));
}

TEST(Calendar, DaysOfTheYear) {
  EXPECT_EQ(day_of_year({.year = 2026, .month = 1, .day = 1}), 1);
  EXPECT_EQ(day_of_year({.year = 2026, .month = 12, .day = 31}), 365);
  EXPECT_EQ(day_of_year({.year = 2024, .month = 3, .day = 1}), 61);
  EXPECT_EQ(day_of_year({.year = 2000, .month = 12, .day = 31}), 366);
  EXPECT_EQ(day_of_year({.year = 2100, .month = 3, .day = 1}), 60) << "2100 is no leap year";
}

}  // namespace
}  // namespace hueline
