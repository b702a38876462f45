#include "core/drive_command.hpp"

#include <gtest/gtest.h>

namespace hueline {
namespace {

std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

TEST(DriveCommand, ComesBackFromItsBytes) {
  for (const DriveCommand& command :
       {DriveCommand{DriveCommand::Kind::Mark, "bump ✓ 路口"}, DriveCommand{DriveCommand::Kind::Mark, ""},
        DriveCommand{DriveCommand::Kind::Stop, ""}}) {
    const auto read = decode_command(encode_command(command));
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(read->kind, command.kind);
    EXPECT_EQ(read->note, command.note);
  }
}

TEST(DriveCommand, RefusesWhatIsNone) {
  for (const std::string& text :
       {std::string(), std::string("mark"), std::string("dance\n"), std::string("mark\na\nb"),
        std::string("mark\n\x1b[2J"), std::string("mark\n\xff"), "mark\n" + std::string(501, 'x')})
    EXPECT_EQ(decode_command(bytes(text)).error().code, ErrorCode::Malformed) << text;
  EXPECT_TRUE(decode_command(bytes("mark\n" + std::string(500, 'x'))).ok());
}

}  // namespace
}  // namespace hueline
