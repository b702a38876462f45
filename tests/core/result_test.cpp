#include "core/result.hpp"

#include <gtest/gtest.h>

namespace hueline {
namespace {

TEST(Result, HoldsAValueOrAnError) {
  const Result<int> seven = 7;
  ASSERT_TRUE(seven.ok());
  EXPECT_EQ(*seven, 7);
  const Result<int> none = Error{ErrorCode::TimedOut, "nothing came"};
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::TimedOut);
  EXPECT_EQ(none.error().message, "nothing came");
}

TEST(Result, GivesAwayItsValue) {
  Result<std::string> text = std::string(100, 'x');
  const std::string taken = std::move(text).value();
  EXPECT_EQ(taken.size(), 100u);
}

using ResultDeathTest = ::testing::Test;

TEST(ResultDeathTest, SaysWhichErrorWasOverlooked) {
  Result<int> none = Error{ErrorCode::Io, "open x: No such file or directory"};
  EXPECT_DEATH((void)none.value(), "Io: open x: No such file or directory");
  EXPECT_DEATH((void)*none, "Io: open x");
  EXPECT_DEATH((void)std::move(none).value(), "Io: open x");
}

TEST(ResultDeathTest, HasNoErrorWhenAllIsWell) {
  const Result<int> seven = 7;
  EXPECT_DEATH((void)seven.error(), "the error of a Result was used that is a value");
  const Status fine;
  EXPECT_DEATH((void)fine.error(), "the error of a Result was used that is a value");
}

}  // namespace
}  // namespace hueline
