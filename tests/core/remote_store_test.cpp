// Files at addresses, read as files of this computer are.
#include "core/remote_store.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/output_file.hpp"
#include "tests/support/folder_store.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

TEST(RemoteStore, GivesFilesToWhoeverReadsThem) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "drive");
  test::write_file(folder / "drive/drive.mcap", "0123456789");
  const test::FolderStore store(folder.path());
  const auto file = InputFile::open(std::filesystem::path("s3://here/drive") / "drive.mcap");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->size(), 10u);
  EXPECT_EQ(file->path(), "s3://here/drive/drive.mcap");
  std::array<std::byte, 4> part{};
  ASSERT_TRUE(file->read(3, part).ok());
  EXPECT_EQ(part[0], std::byte{'3'});
  EXPECT_EQ(file->read(7, part).error().code, ErrorCode::Truncated);
  EXPECT_EQ(file->check_on_this_computer().error().code, ErrorCode::Unsupported);

  // A stream outlives the file that gave it.
  std::FILE* stream = nullptr;
  {
    const auto again = InputFile::open("s3://here/drive/drive.mcap");
    stream = again->stream().value();
  }
  std::array<char, 20> all{};
  EXPECT_EQ(std::fread(all.data(), 1, all.size(), stream), 10u);
  EXPECT_EQ(std::string(all.data()), "0123456789");
  EXPECT_EQ(std::ferror(stream), 0);
  std::fclose(stream);

  EXPECT_TRUE(holds("s3://here/drive", "drive.mcap"));
  EXPECT_FALSE(holds("s3://here/drive", "cloud.las"));
  EXPECT_TRUE(is_folder("s3://here/drive"));
  EXPECT_FALSE(is_folder("s3://here/drive/drive.mcap"));
  EXPECT_EQ(InputFile::open("s3://here/nothing").error().code, ErrorCode::Io);
}

TEST(RemoteStore, IsMissedWithAMessage) {
  const auto file = InputFile::open("s3://here/drive.mcap");
  EXPECT_EQ(file.error().code, ErrorCode::Unsupported);
  EXPECT_NE(file.error().message.find("reads no object storage"), std::string::npos);
}

TEST(RemoteStore, TakesNoOutputs) {
  EXPECT_EQ(check_output("s3://here/cloud.las").error().code, ErrorCode::Unsupported);
  EXPECT_EQ(check_output_folder("s3://here/drive").error().code, ErrorCode::Unsupported);
  EXPECT_FALSE(OutputFolder::open("s3://here/drive").ok());
  EXPECT_FALSE(std::filesystem::exists("s3:"));
}

TEST(RemoteStore, AddressesStayAsTheyAre) {
  EXPECT_EQ(absolute_name("s3://here/drive/").native(), "s3://here/drive");
  EXPECT_EQ(absolute_name("/a/./b/").native(), "/a/b");
  EXPECT_TRUE(absolute_name("a").is_absolute());
}

}  // namespace
}  // namespace hueline
