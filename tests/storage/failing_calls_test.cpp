// A recording of which one call of the disk fails, for every call that it makes: what is said of it is true, and what
// is in it is what was recorded.
#include <gtest/gtest.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/journal_reader.hpp"
#include "storage/segmented_journal.hpp"
#include "tests/storage/sample_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

using test::sample_header;
using test::sample_packets;
using test::TemporaryFolder;
using test::time_of;

/// How a call fails.
struct Failure {
  int errno_value;
  bool is_last = false;       ///< all later calls of this volume fail too
  bool takes_half = false;    ///< an append takes half of its bytes first, and the call after it fails
  const char* name = "once";  ///< for messages
};

/// A disk that does not wait for a medium, of which call number `at` of the files in `folder` fails.
class DiskWithFailure final : public Disk {
 public:
  DiskWithFailure(std::filesystem::path folder, std::uint64_t at, Failure failure)
      : folder_(std::move(folder)), at_(at), failure_(failure) {}
  /// Calls so far.
  std::uint64_t calls() const { return calls_; }
  bool has_failed() const { return calls_ >= at_; }
  const std::string& failed_call() const { return failed_call_; }

  int create(const std::filesystem::path& path, IfExists if_exists, std::unique_ptr<DiskFile>& file) override {
    const bool is_here = is_ours(path);
    if (is_here && fails("create")) return -failure_.errno_value;
    int fd = -1;
    if (const int result = open_output(path, if_exists, fd); result != 0) return result;
    file = std::make_unique<File>(fd, is_here ? this : nullptr);
    return 0;
  }
  int remove(const std::filesystem::path& path) override {
    if (is_ours(path) && fails("remove")) return -failure_.errno_value;
    return ::unlink(path.c_str()) == 0 ? 0 : -errno;
  }
  int link(const std::filesystem::path& target, const std::filesystem::path& path) override {
    if (is_ours(path) && fails("link")) return -failure_.errno_value;
    return ::symlink(target.c_str(), path.c_str()) == 0 ? 0 : -errno;
  }

 private:
  class File final : public DiskFile {
   public:
    File(int fd, DiskWithFailure* disk) : fd_(fd), disk_(disk) {}
    ~File() override {
      if (fd_ >= 0) ::close(fd_);
    }
    std::int64_t append(std::span<const iovec> pieces) override {
      iovec half = pieces.front();
      half.iov_len /= 2;
      if (!fails("append")) return answer(::writev(fd_, pieces.data(), static_cast<int>(pieces.size())));
      if (!disk_->failure_.takes_half || half.iov_len == 0) return error();
      disk_->at_ = disk_->calls_ + 1;
      return answer(::write(fd_, half.iov_base, half.iov_len));
    }
    std::int64_t overwrite(std::uint64_t offset, std::span<const std::byte> bytes) override {
      if (fails("overwrite")) return error();
      return answer(::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset)));
    }
    int sync() override { return fails("sync") ? error() : 0; }
    int truncate(std::uint64_t size) override {
      if (fails("truncate")) return error();
      const auto end = static_cast<off_t>(size);
      return ::ftruncate(fd_, end) == 0 && ::lseek(fd_, end, SEEK_SET) == end ? 0 : -errno;
    }
    int check_place() override { return fails("check_place") ? error() : 0; }
    int close() override {
      ::close(std::exchange(fd_, -1));
      return fails("close") ? error() : 0;
    }

   private:
    static std::int64_t answer(ssize_t result) { return result < 0 ? -errno : result; }
    bool fails(const char* call) { return disk_ != nullptr && disk_->fails(call); }
    int error() const { return -disk_->failure_.errno_value; }
    int fd_;
    DiskWithFailure* disk_;
  };

  bool is_ours(const std::filesystem::path& path) const { return path.parent_path() == folder_; }
  bool fails(const char* call) {
    ++calls_;
    const bool now = calls_ == at_ || (failure_.is_last && calls_ > at_);
    if (now && failed_call_.empty()) failed_call_ = call;
    return now;
  }

  std::filesystem::path folder_;
  std::uint64_t at_, calls_ = 0;
  Failure failure_;
  std::string failed_call_;
};

/// What was said of a recording while it was made.
struct Said {
  bool was_created = false;
  std::uint64_t refused = 0;  ///< packets whose append() failed
  std::uint64_t written = 0, on_medium = 0;
  Status closed;
  RemovedSegments removed;
};

Said record_saying(const std::filesystem::path& path, const std::vector<Packet>& packets,
                   const SegmentedJournal::Config& config, Disk& disk) {
  Said said;
  auto journal = SegmentedJournal::create(path, sample_header(), config, disk);
  said.closed = journal.ok() ? Status() : Status(journal.error());
  if (!journal.ok()) return said;
  said.was_created = true;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    said.refused += !journal->append(packets[i], time_of(packets[i])).ok();
    // What these say, the next append says too.
    if (i % 16 == 0) (void)journal->check_place();
    if (i % 10 == 9) (void)journal->write_due(time_of(packets[i]) + std::chrono::milliseconds(100));
  }
  said.closed = journal->close();
  said.written = journal->packets_written();
  said.on_medium = journal->packets_on_medium();
  said.removed = journal->removed();
  return said;
}

struct ReadBack {
  std::vector<Packet> packets;
  ErrorCode end{};
  std::string message;
};
std::optional<ReadBack> read_back(const std::filesystem::path& path) {
  auto reader = JournalReader::open(path);
  if (!reader.ok()) return std::nullopt;
  ReadBack out;
  for (;;) {
    auto packet = (*reader)->next({});
    if (packet.ok()) {
      out.packets.push_back(*packet);
      continue;
    }
    out.end = packet.error().code;
    out.message += packet.error().message + "; ";
    if (out.end != ErrorCode::Malformed) return out;
  }
}

/// Whether every packet that was found is one that was sent, in their order, each at most once.
bool is_part_of(const std::vector<Packet>& found, const std::vector<Packet>& sent) {
  auto next = sent.begin();
  for (const Packet& packet : found) {
    next = std::find_if(next, sent.end(), [&](const Packet& one) { return test::same(one, packet); });
    if (next == sent.end()) return false;
    ++next;
  }
  return true;
}

/// Records with every call failing once, in each of the ways, and looks at each recording.
void fail_every_call(const SegmentedJournal::Config& config, const std::vector<Packet>& packets,
                     std::uint64_t least_calls) {
  constexpr Failure kFailures[] = {{EIO},
                                   {ENOSPC, false, true, "once, an append in its middle"},
                                   {EIO, true, false, "from then on"},
                                   {ENOSPC, true, true, "from then on, an append in its middle"}};
  for (const Failure& failure : kFailures) {
    for (std::uint64_t at = 1;; ++at) {
      const TemporaryFolder folder;
      std::filesystem::create_directories(folder / "drive");
      SegmentedJournal::Config here = config;
      for (auto& volume : here.volumes) {
        volume = folder / volume;
        std::filesystem::create_directories(volume);
      }
      const auto path = folder / "drive/drive.mcap";
      DiskWithFailure disk(folder / "drive", at, failure);
      const Said said = record_saying(path, packets, here, disk);
      SCOPED_TRACE("call " + std::to_string(at) + " (" + disk.failed_call() + ") fails " + failure.name);
      if (!disk.has_failed()) {
        ASSERT_TRUE(said.closed.ok()) << said.closed.error().message;
        EXPECT_GE(at, least_calls) << "calls were not counted";
        EXPECT_EQ(said.removed.segments > 0, config.ring_bytes > 0);
        break;
      }
      const auto found = read_back(path);
      if (!said.was_created) {
        ASSERT_FALSE(said.closed.error().message.empty());
        ASSERT_TRUE(!found || found->packets.empty());
        continue;
      }
      ASSERT_TRUE(found) << "what was begun cannot be opened";
      ASSERT_TRUE(is_part_of(found->packets, packets)) << found->message;
      // Everything that was told written is there, or was removed by the ring, if the disk let it.
      const std::uint64_t accounted = found->packets.size() + said.removed.packets;
      ASSERT_TRUE(said.closed.ok() ? accounted == said.written : accounted >= said.written)
          << accounted << " of " << said.written << ": " << found->message;
      ASSERT_LE(said.on_medium, said.written);
      if (said.closed.ok() && said.refused == 0) {
        ASSERT_EQ(said.written, packets.size()) << "packets are missing, and nothing was said";
        ASSERT_EQ(found->end, ErrorCode::EndOfData) << found->message;
        ASSERT_EQ(said.on_medium, said.written);
      } else {
        ASSERT_FALSE(said.closed.ok()) << said.refused << " packets were refused, and the end says that all is well";
        ASSERT_NE(said.closed.error().message.find(".mcap"), std::string::npos) << said.closed.error().message;
      }
    }
  }
}

TEST(FailingCalls, OfARecordingInOneFile) {
  SegmentedJournal::Config config;
  config.segment.chunk_bytes = 2048;
  config.segment.sync_interval = std::chrono::milliseconds(10);
  fail_every_call(config, sample_packets(60, 3000), 50);
}

TEST(FailingCalls, OfARecordingInSegmentsOfARing) {
  SegmentedJournal::Config config;
  config.segment.chunk_bytes = 2048;
  config.segment.sync_interval = std::chrono::milliseconds(20);
  config.segment_bytes = 16'000;
  config.ring_bytes = 50'000;
  config.recording = "0123456789abcdef";
  fail_every_call(config, sample_packets(80, 3000), 100);
}

TEST(FailingCalls, OfARecordingWithAnotherVolume) {
  SegmentedJournal::Config config;
  config.segment.chunk_bytes = 2048;
  config.segment.sync_interval = std::chrono::milliseconds(20);
  config.segment_bytes = 16'000;
  config.volumes = {"second"};
  config.recording = "0123456789abcdef";
  fail_every_call(config, sample_packets(55, 3000), 60);
}

}  // namespace
}  // namespace hueline::storage
