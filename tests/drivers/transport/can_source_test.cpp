// What CanSource reports where there is no CAN. tests/vm/can_test.cpp has the frames of a real interface.
#include "drivers/transport/can_source.hpp"

#include <gtest/gtest.h>

namespace hueline::drivers {
namespace {

TEST(CanSource, AMissingInterfaceIsAskedForAgain) {
  CanSource source({.interface = "hueline_none"}, BufferPool(1 << 20));
  for (int i = 0; i < 2; ++i) {
    const Status opened = source.open();
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::Unavailable) << opened.error().message;
  }
  const auto nothing = source.next({});
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().code, ErrorCode::Disconnected);
}

TEST(CanSource, ConfigIsChecked) {
  EXPECT_NE(CanSource::Config{}.validate(), "");
  EXPECT_NE((CanSource::Config{.interface = "sixteen_letters_"}.validate()), "");
  EXPECT_NE((CanSource::Config{.interface = "can0", .batch = 0}.validate()), "");
  EXPECT_EQ((CanSource::Config{.interface = "can0"}.validate()), "");
  CanSource source({}, BufferPool(1 << 20));
  EXPECT_EQ(source.open().error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::drivers
