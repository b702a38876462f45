#include "core/base64.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace hueline {
namespace {

TEST(Base64, IsThatOfTheStandard) {
  // RFC 4648, section 10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, GivesBackTheBytes) {
  std::string bytes;
  for (int i = 0; i < 300; ++i) {
    EXPECT_EQ(from_base64(base64(bytes)), bytes);
    bytes += static_cast<char>(37 * i);
  }
  EXPECT_EQ(from_base64("Zg"), "f") << "without padding";
  EXPECT_EQ(from_base64("//8="), "\xFF\xFF");
  for (const char* wrong : {"Z", "Zm9vY", "Zm9v!mFy", "Zg==Zg==", "Zm 9v", "-_8="})
    EXPECT_EQ(from_base64(wrong), std::nullopt) << wrong;
}

}  // namespace
}  // namespace hueline
