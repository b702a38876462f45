#include "core/output_file.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "core/input_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

namespace fs = std::filesystem;
using test::contents;
using test::TemporaryFolder;
using test::write_file;
using testing::HasSubstr;

/// All writing goes through open_output(). The attempt and the check beforehand must give the same answer.
void expect_refused(const fs::path& path, const std::string& why) {
  const Status before = check_output(path);
  ASSERT_FALSE(before.ok()) << path;
  EXPECT_THAT(before.error().message, HasSubstr(why));
  const Status then = write_output(path, "new");
  ASSERT_FALSE(then.ok()) << path;
  EXPECT_THAT(then.error().message, HasSubstr(why));
}

TEST(OutputFile, ReplacesWhatIsThere) {
  const TemporaryFolder folder;
  write_file(folder / "a", "something longer");
  ASSERT_TRUE(check_output(folder / "a").ok());
  ASSERT_TRUE(write_output(folder / "a", "short").ok());
  EXPECT_EQ(contents(folder / "a"), "short");
}

TEST(OutputFile, KeepsTheOlderFileIfTheNewOneCannotBeWritten) {
  const TemporaryFolder folder;
  write_file(folder / "a", "what was there");
  const pid_t child = ::fork();
  if (child == 0) {
    // A file that may not grow refuses bytes as a full disk does.
    const rlimit limit{.rlim_cur = 5, .rlim_max = 5};
    ::signal(SIGXFSZ, SIG_IGN);
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::_exit(write_output(folder / "a", "longer than five bytes").ok() ? 1 : 0);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0) << "the write had to fail";
  EXPECT_EQ(contents(folder / "a"), "what was there");
  EXPECT_FALSE(fs::exists(folder / "a.part"));
}

TEST(OutputFile, KeepsTheRightsOfTheOlderFile) {
  const TemporaryFolder folder;
  write_file(folder / "a", "private");
  fs::permissions(folder / "a", fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(write_output(folder / "a", "new").ok());
  EXPECT_EQ(contents(folder / "a"), "new");
  EXPECT_EQ(fs::status(folder / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST(OutputFile, RemovesNoPartThatItCouldNotOpen) {
  const TemporaryFolder folder;
  write_file(folder / "a.part", "of something else, which is being read");
  const auto input = InputFile::open(folder / "a.part");
  ASSERT_TRUE(input.ok());
  EXPECT_FALSE(write_output(folder / "a", "new").ok());
  EXPECT_EQ(contents(folder / "a.part"), "of something else, which is being read");
}

TEST(OutputFile, IsNoFileThatIsReadUnderAnyName) {
  const TemporaryFolder folder;
  write_file(folder / "in", "precious");
  fs::create_hard_link(folder / "in", folder / "same");
  {
    const auto input = InputFile::open(folder / "in");
    ASSERT_TRUE(input.ok());
    expect_refused(folder / "in", "this command reads that file");
    expect_refused(folder / "same", "this command reads that file");
    expect_refused(folder.path() / "." / "in", "this command reads that file");
  }
  EXPECT_EQ(contents(folder / "in"), "precious");
  EXPECT_TRUE(write_output(folder / "in", "read no more").ok());
}

TEST(OutputFile, HoldsAnInputUntilItsLastReaderIsGone) {
  const TemporaryFolder folder;
  write_file(folder / "in", "precious");
  auto first = InputFile::open(folder / "in");
  {
    const auto second = InputFile::open(folder / "in");
    InputFile moved = std::move(*first);
    expect_refused(folder / "in", "this command reads that file");
    first = InputFile::open(folder / "in");
  }
  expect_refused(folder / "in", "this command reads that file");
  EXPECT_EQ(contents(folder / "in"), "precious");
}

TEST(OutputFile, IsNotReachedThroughALink) {
  const TemporaryFolder folder;
  write_file(folder / "precious", "bytes");
  fs::create_symlink(folder / "precious", folder / "link");
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  expect_refused(folder / "link", "symbolic link");
  expect_refused(folder / "dangling", "symbolic link");
  EXPECT_EQ(contents(folder / "precious"), "bytes");
  EXPECT_FALSE(fs::exists(folder / "nowhere"));
}

TEST(OutputFile, LeavesTheBytesToTheOtherNamesOfAFile) {
  const TemporaryFolder folder;
  write_file(folder / "backup", "of yesterday");
  fs::create_hard_link(folder / "backup", folder / "cloud");
  ASSERT_TRUE(write_output(folder / "cloud", "of today").ok());
  EXPECT_EQ(contents(folder / "backup"), "of yesterday");
  EXPECT_EQ(contents(folder / "cloud"), "of today");
}

TEST(OutputFile, IsNoFolderAndHasOne) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "sub");
  expect_refused(folder / "sub", "Is a directory");
  expect_refused(folder / "absent" / "file", "the folder does not exist");
}

TEST(OutputFile, AsksForALineInAnExistingFileOnlyWithReplace) {
  const TemporaryFolder folder;
  write_file(folder / "recording", "raw");
  int fd = -1;
  EXPECT_EQ(open_output(folder / "recording", IfExists::Refuse, fd), -EEXIST);
  EXPECT_EQ(contents(folder / "recording"), "raw");
}

TEST(OutputFolder, IsHeldByOneAndLetGoAtItsEnd) {
  const TemporaryFolder folder;
  const fs::path drive = folder / "a" / "drive";
  {
    const auto mine = OutputFolder::open(drive);
    ASSERT_TRUE(mine.ok()) << mine.error().message;
    EXPECT_TRUE(fs::is_directory(drive));
    const auto theirs = OutputFolder::open(folder / "a" / "." / "drive");
    ASSERT_FALSE(theirs.ok());
    EXPECT_EQ(theirs.error().code, ErrorCode::Unavailable);
    EXPECT_TRUE(write_output(drive / "cloud.las", "mine").ok()) << "its holder writes into it";
  }
  EXPECT_TRUE(OutputFolder::open(drive).ok());
}

TEST(OutputFolder, KeepsOtherProgramsFilesOutUntilItsProcessEnds) {
  const TemporaryFolder folder;
  write_file(folder / "cloud.las", "theirs");
  int started[2];
  ASSERT_EQ(::pipe(started), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {  // another program that holds the folder; only what is safe after fork()
    const int fd = ::open(folder.path().c_str(), O_RDONLY | O_DIRECTORY);
    const char answer = ::flock(fd, LOCK_EX | LOCK_NB) == 0 ? 'y' : 'n';
    if (::write(started[1], &answer, 1) != 1) ::_exit(1);
    for (;;) ::pause();
  }
  char answer = 0;
  ASSERT_EQ(::read(started[0], &answer, 1), 1);
  ASSERT_EQ(answer, 'y');
  expect_refused(folder / "cloud.las", "another capture, replay or the like");
  EXPECT_FALSE(check_output_folder(folder.path()).ok());
  EXPECT_FALSE(OutputFolder::open(folder.path()).ok());
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(contents(folder / "cloud.las"), "theirs");
  EXPECT_TRUE(OutputFolder::open(folder.path()).ok());
  ::close(started[0]);
  ::close(started[1]);
}

TEST(OutputFolder, IsCheckedWithoutBeingMade) {
  const TemporaryFolder folder;
  write_file(folder / "file", "");
  EXPECT_TRUE(check_output_folder(folder / "new" / "").ok());
  EXPECT_TRUE(check_output_folder(folder / "new" / "newer").ok());
  EXPECT_FALSE(fs::exists(folder / "new"));
  EXPECT_FALSE(check_output_folder(folder / "file").ok());
  EXPECT_FALSE(check_output_folder(folder / "file" / "below").ok());
}

TEST(InputFile, IsAFileAndNothingThatHasToBeWaitedFor) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const auto pipe = InputFile::open(folder / "pipe");
  ASSERT_FALSE(pipe.ok());
  EXPECT_THAT(pipe.error().message, HasSubstr("is a pipe, not a file"));
  const auto device = InputFile::open("/dev/null");
  ASSERT_FALSE(device.ok());
  EXPECT_THAT(device.error().message, HasSubstr("is a device, not a file"));
  EXPECT_THAT(InputFile::open(folder.path()).error().message, HasSubstr("Is a directory"));
  EXPECT_THAT(InputFile::open(folder / "absent").error().message, HasSubstr("No such file"));
}

TEST(InputFile, IsReadWholeUpToALimitThatIsTold) {
  const TemporaryFolder folder;
  write_file(folder / "text", std::string(2'000'001, 'x'));
  EXPECT_EQ(read_input(folder / "text", 2'000'001, "a text")->size(), 2'000'001u);
  const auto larger = read_input(folder / "text", 2'000'000, "a text");
  ASSERT_FALSE(larger.ok());
  EXPECT_EQ(larger.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(larger.error().message, HasSubstr("a text of more than 2 MB is not read"));
}

}  // namespace
}  // namespace hueline
