#include "core/scratch_file.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using test::TemporaryFolder;

std::span<const std::byte> bytes_of_text(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(ScratchFile, GivesBackWhatWasAppendedAndHasNoName) {
  const TemporaryFolder folder;
  auto file = ScratchFile::create(folder.path());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(*file->append(bytes_of_text("first")), 0u);
  EXPECT_EQ(*file->append(bytes_of_text("second")), 5u);
  ScratchFile moved = std::move(*file);
  std::array<char, 6> text{};
  ASSERT_TRUE(moved.read(5, std::as_writable_bytes(std::span(text))));
  EXPECT_EQ(std::string(text.data(), text.size()), "second");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_EQ(moved.read(6, std::as_writable_bytes(std::span(text))).error().code, ErrorCode::Truncated);
}

TEST(ScratchFile, SaysWhereItCannotBeMade) {
  const auto file = ScratchFile::create("/nonexistent");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::Io);
  EXPECT_NE(file.error().message.find("make a scratch file in /nonexistent"), std::string::npos);
}

}  // namespace
}  // namespace hueline
