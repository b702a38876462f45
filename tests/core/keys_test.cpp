#include "core/keys.hpp"

#include <gtest/gtest.h>

namespace hueline {
namespace {

struct Inner {
  int count = 3;
  void visit(Keys& keys) { keys.whole({"count", "", "How many."}, count, {1, 5}); }
  KeyError validate() const { return check_keys(*this); }
};

struct Outer {
  double angle = 0.1;
  nanoseconds delay{1500};
  std::optional<double> gain;
  std::string address = "10.0.0.1";
  std::vector<double> place{0, 0};
  Inner inner;
  std::vector<Inner> list{{}, {}};

  void visit(Keys& keys) {
    keys.angle({"angle_deg", "deg", "An angle."}, angle, {0, 90, Ends::MinOnly});
    keys.duration({"delay_us", "us", "A time."}, delay, {0, 10});
    keys.number({"gain", "dB", "A gain."}, gain, {0, 1, Ends::MaxOnly});
    keys.text({"address", "", "An address."}, address, kIpv4Address);
    keys.numbers({"place", "m", "A place."}, place, {-1, 1}, {2, 2});
    keys.section({"inner", "", "A mapping."}, inner);
    keys.list({"list", "", "A list."}, list, {1, 3});
  }
  KeyError validate() const { return check_keys(*this); }
};

std::string complaint(auto change) {
  Outer config;
  change(config);
  return config.validate();
}

TEST(Keys, AValueOutsideItsRangeIsNamedByItsKeyInTheUnitOfFiles) {
  EXPECT_EQ(Outer().validate(), "");
  EXPECT_EQ(complaint([](Outer& c) { c.angle = 1.6; }),
            "angle_deg is 91.6732; allowed: a number from 0 to below 90 deg");
  EXPECT_EQ(complaint([](Outer& c) { c.delay = nanoseconds(10'500); }),
            "delay_us is 10.5; allowed: a number from 0 to 10 us");
  EXPECT_EQ(complaint([](Outer& c) { c.gain = 0; }), "gain is 0; allowed: a number from above 0 to 1 dB");
  EXPECT_EQ(complaint([](Outer& c) { c.gain = std::numeric_limits<double>::quiet_NaN(); }),
            "gain is nan; allowed: a number from above 0 to 1 dB");
  EXPECT_EQ(complaint([](Outer& c) { c.address = "host"; }), "address is 'host'; allowed: an IPv4 address");
  EXPECT_EQ(complaint([](Outer& c) { c.place = {0, 2}; }), "place is 2; allowed: a number from -1 to 1 m");
  EXPECT_EQ(complaint([](Outer& c) { c.place = {0}; }), "place is a list of 1; allowed: 2 or more");
  EXPECT_EQ(complaint([](Outer& c) { c.list.clear(); }), "list is a list of 0; allowed: 1 to 3");
}

TEST(Keys, AWrongKeyInsideAMappingIsNamedWithItsPath) {
  EXPECT_EQ(complaint([](Outer& c) { c.inner.count = 6; }), "inner.count is 6; allowed: a whole number from 1 to 5");
  EXPECT_EQ(complaint([](Outer& c) { c.list[1].count = 0; }),
            "list[1].count is 0; allowed: a whole number from 1 to 5");
}

TEST(Keys, ChecksAndDocumentsLeaveMembersAlone) {
  Outer config;
  config.angle = 0.123456789012345678;
  config.delay = nanoseconds(1'234);
  const Outer before = config;
  EXPECT_TRUE(check_group(group_of(config)).empty());
  EXPECT_EQ(config.angle, before.angle);
  EXPECT_EQ(config.delay, before.delay);
}

}  // namespace
}  // namespace hueline
