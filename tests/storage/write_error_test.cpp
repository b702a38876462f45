// What the operating system can refuse: the error is clear, and what was written before it reads as a recording.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>

#include "storage/journal_reader.hpp"
#include "storage/journal_writer.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::same;
using test::sample_header;
using test::sample_packets;
using test::TemporaryFolder;

JournalWriter::Config small_chunks() {
  JournalWriter::Config config;
  config.chunk_bytes = 64 * 1024;
  return config;
}

/// Limits of a process are changed in a child: 0 when every expectation held, else the number of the one that did not.
int in_child(const std::function<int()>& body) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(body());
  int result = -1;
  ::waitpid(child, &result, 0);
  return WIFEXITED(result) ? WEXITSTATUS(result) : 100 + WTERMSIG(result);
}

/// Appends until it is refused, then checks that all that follows repeats the first error and that the counts agree.
int fill_up(const std::filesystem::path& path, const std::vector<Packet>& packets, const char* reason) {
  auto writer = JournalWriter::create(path, sample_header(), small_chunks());
  if (!writer) return 1;
  std::uint64_t refused = 0;
  std::string first;
  for (const Packet& p : packets)
    if (const Status appended = writer->append(p, test::time_of(p)); !appended) {
      ++refused;
      if (appended.error().code != ErrorCode::Io) return 2;
      if (first.empty()) first = appended.error().message;
      if (appended.error().message != first) return 3;
    }
  if (refused == 0) return 4;
  if (first.find(reason) == std::string::npos) return 5;
  const Status closed = writer->close();
  if (closed.ok() || closed.error().message != first) return 6;
  if (writer->packets_written() + writer->packets_lost() + refused != packets.size()) return 7;
  if (writer->packets_written() == 0) return 8;
  if (writer->bytes_written() != std::filesystem::file_size(path)) return 9;
  return 0;
}

/// What is there is a prefix of what was sent, and it is told whether the recording has its end.
void expect_readable(const std::filesystem::path& path, const std::vector<Packet>& packets, ErrorCode end_with) {
  auto reader = JournalReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  std::size_t read = 0;
  while (true) {
    const auto packet = (*reader)->next({});
    if (!packet) {
      EXPECT_EQ(packet.error().code, end_with) << packet.error().message;
      break;
    }
    ASSERT_TRUE(same(*packet, packets[read++]));
  }
  EXPECT_GT(read, 0u);
  EXPECT_LT(read, packets.size());
}

TEST(WriteError, FileSizeLimit) {
  const TemporaryFolder folder;
  const auto packets = sample_packets(300);
  ASSERT_EQ(in_child([&] {
              std::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit{700'000, 700'000};
              ::setrlimit(RLIMIT_FSIZE, &limit);
              return fill_up(folder / "drive.mcap", packets, "at byte ");
            }),
            0);
  // After the refused chunk was cut off there was room for the summary.
  expect_readable(folder / "drive.mcap", packets, ErrorCode::EndOfData);
}

TEST(WriteError, FullDisk) {
  const TemporaryFolder folder;
  const auto disk = folder / "disk";
  std::filesystem::create_directory(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=1m") != 0) GTEST_SKIP() << "no right to mount a small tmpfs";
  const auto packets = sample_packets(400);
  EXPECT_EQ(in_child([&] { return fill_up(disk / "drive.mcap", packets, "disk is full"); }), 0);
  expect_readable(disk / "drive.mcap", packets, ErrorCode::EndOfData);
  EXPECT_EQ(::umount(disk.c_str()), 0);
}

TEST(WriteError, ReadOnlyFileSystem) {
  const TemporaryFolder folder;
  const auto disk = folder / "disk";
  std::filesystem::create_directory(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", MS_RDONLY, "size=1m") != 0) GTEST_SKIP() << "no right to mount a tmpfs";
  const auto writer = JournalWriter::create(disk / "drive.mcap", sample_header());
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("read-only"), std::string::npos) << writer.error().message;
  EXPECT_EQ(::umount(disk.c_str()), 0);
}

TEST(WriteError, DeviceThatIsAlwaysFull) {
  JournalWriter::Config config = small_chunks();
  config.if_exists = IfExists::Replace;
  const auto writer = JournalWriter::create("/dev/full", sample_header(), config);
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("disk is full"), std::string::npos) << writer.error().message;
}

TEST(WriteError, MissingFolder) {
  const auto writer = JournalWriter::create("/nonexistent/drive.mcap", sample_header());
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("folder does not exist"), std::string::npos) << writer.error().message;
}

TEST(FileWriter, GoesOnAfterShortWrites) {
  const TemporaryFolder folder;
  // A pipe takes as much as it has room for: writev is short again and again.
  const auto pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Buffer a = test::pattern_buffer(300'000, 1), b = test::pattern_buffer(777'777, 2);
  const std::string copy = "cat " + pipe.string() + " > " + (folder / "copy").string();
  std::FILE* cat = ::popen(copy.c_str(), "r");
  ASSERT_NE(cat, nullptr);
  {
    auto file = FileWriter::create(pipe, IfExists::Replace);
    ASSERT_TRUE(file) << file.error().message;
    std::vector<ByteView> pieces;
    for (std::size_t i = 0; i < 3000; ++i)
      pieces.push_back(a.bytes().subspan(i * 100, 100));  // more than one call takes
    pieces.push_back({});
    pieces.push_back(b.bytes());
    ASSERT_TRUE(file->write(pieces));
    EXPECT_EQ(file->size(), a.size() + b.size());
    ASSERT_TRUE(file->close());
  }
  ASSERT_EQ(::pclose(cat), 0);
  const std::string got = test::contents(folder / "copy");
  ASSERT_EQ(got.size(), a.size() + b.size());
  EXPECT_TRUE(std::equal(a.bytes().begin(), a.bytes().end(), as_bytes(got).begin()));
  EXPECT_TRUE(std::equal(b.bytes().begin(), b.bytes().end(), as_bytes(got).begin() + 300'000));
}

TEST(FileWriter, ReplacesAFileOnlyByAWholeOne) {
  const test::TemporaryFolder folder;
  const auto path = folder / "cloud.laz";
  test::write_file(path, "what was there");
  const auto names = [&] {
    return std::distance(std::filesystem::directory_iterator(folder.path()), std::filesystem::directory_iterator());
  };
  {
    auto file = FileWriter::replace(path);
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE(file->write(as_bytes("a part")));
    EXPECT_EQ(test::contents(path), "what was there");
  }
  EXPECT_EQ(test::contents(path), "what was there") << "the writer gave up";
  EXPECT_EQ(names(), 1) << "and left nothing";
  auto file = FileWriter::replace(path);
  ASSERT_TRUE(file->write(as_bytes("a whole")));
  FileWriter moved = std::move(*file);
  ASSERT_TRUE(moved.close());
  EXPECT_EQ(test::contents(path), "a whole");
  EXPECT_EQ(names(), 1);
  const auto longest = folder / (std::string(251, 'n') + ".laz");
  auto named = FileWriter::replace(longest);
  ASSERT_TRUE(named) << named.error().message;
  ASSERT_TRUE(named->close());
  EXPECT_TRUE(std::filesystem::exists(longest)) << "no name is too long for the file beside it";
  std::filesystem::create_symlink(path, folder / "link");
  EXPECT_FALSE(FileWriter::replace(folder / "link")) << "as every output";
}

}  // namespace
}  // namespace hueline::storage
