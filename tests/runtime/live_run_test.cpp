#include "runtime/live_run.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <semaphore>
#include <thread>

#include "drivers/transport/host_clock.hpp"
#include "storage/journal_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::runtime {
namespace {

using namespace std::chrono_literals;
using test::TemporaryFolder;

Packet packet_of(SensorId sensor, std::size_t bytes = 100) {
  return {sensor, PacketKind::Wire, false, 0, drivers::host_now(), Buffer::copy_of(std::vector<std::byte>(bytes))};
}

/// Sends some packets, then stays silent until it is stopped.
class Quiet : public PacketSource {
 public:
  explicit Quiet(int packets) : left_(packets) {}
  Status open() override { return {}; }
  Result<Packet> next(std::stop_token) override {
    if (left_-- > 0) return packet_of(1);
    std::this_thread::sleep_for(1ms);
    return Error{ErrorCode::TimedOut, "nothing"};
  }
  void close() override {}

 private:
  int left_;
};

/// A device whose library does not return until it is released.
class Stuck : public PacketSource {
 public:
  Stuck(std::atomic<bool>& is_stuck, std::binary_semaphore& let_go) : is_stuck_(is_stuck), let_go_(let_go) {}
  Status open() override {
    is_stuck_ = true;
    let_go_.acquire();
    return Error{ErrorCode::Unavailable, "does not answer"};
  }
  Result<Packet> next(std::stop_token) override { return Error{ErrorCode::Disconnected, "gone"}; }
  void close() override {}

 private:
  std::atomic<bool>& is_stuck_;
  std::binary_semaphore& let_go_;
};

std::unique_ptr<storage::SegmentedJournal> journal_at(const std::filesystem::path& path) {
  storage::JournalHeader header;
  for (const char* name : {"hueline", "quiet", "stuck"}) header.sensors.push_back({name, name});
  auto journal = storage::SegmentedJournal::create(path, header);
  EXPECT_TRUE(journal.ok());
  return std::make_unique<storage::SegmentedJournal>(std::move(*journal));
}

/// Returns the number of wire packets that a reader finds in the file, and whether the file is whole.
std::pair<int, bool> found_in(const std::filesystem::path& path) {
  auto reader = storage::JournalReader::open(path);
  if (!reader.ok()) return {0, false};
  for (int count = 0;;) {
    const Result<Packet> packet = (*reader)->next({});
    if (!packet.ok()) return {count, packet.error().code == ErrorCode::EndOfData};
    count += packet->kind == PacketKind::Wire;
  }
}

template <class Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 6000; ++i, std::this_thread::sleep_for(5ms))
    if (condition()) return true;
  return false;
}

TEST(LiveRun, FlushesWhatItHasWhileADeviceIsSlowToLeave) {
  TemporaryFolder dir;
  std::binary_semaphore let_go(0);
  std::atomic<bool> is_stuck = false;
  {
    std::vector<LiveRun::Source> sources;
    sources.push_back({1, "quiet", std::make_unique<Quiet>(3), {}, false});
    sources.push_back({2, "stuck", std::make_unique<Stuck>(is_stuck, let_go), {}, false});
    LiveRun run(
        std::move(sources), journal_at(dir / "drive.mcap"), [](const Packet&) {}, LiveRun::Config());
    run.start();
    ASSERT_TRUE(comes_true([&] { return run.ingest().counts(1).packets == 3 && is_stuck; }));
    std::jthread ending([&] { run.stop(); });
    EXPECT_TRUE(comes_true([&] { return found_in(dir / "drive.mcap").first == 3; }))
        << "a kill now would lose what came long ago";
    EXPECT_FALSE(run.is_recording_closed());
    let_go.release();
    ending.join();
    EXPECT_TRUE(run.is_recording_closed());
    EXPECT_FALSE(run.is_a_reader_stuck());
    EXPECT_FALSE(run.are_products_cut());
  }
  EXPECT_EQ(found_in(dir / "drive.mcap"), std::pair(3, true));
}

TEST(LiveRun, EndsAtOnceAroundAStuckReaderAndABusyPipeline) {
  TemporaryFolder dir;
  std::binary_semaphore let_go(0), is_busy(0);
  std::atomic<bool> is_stuck = false;
  std::stop_source at_once;
  {
    std::vector<LiveRun::Source> sources;
    sources.push_back({1, "quiet", std::make_unique<Quiet>(50), {}, false});
    sources.push_back({2, "stuck", std::make_unique<Stuck>(is_stuck, let_go), {}, false});
    std::atomic<int> processed = 0;
    LiveRun run(std::move(sources), journal_at(dir / "drive.mcap"),
                [&](const Packet&) {
                  if (processed++ == 0) is_busy.acquire();
                },
                {});
    run.start();
    ASSERT_TRUE(comes_true([&] { return run.ingest().counts(1).packets == 50 && processed == 1 && is_stuck; }));
    std::jthread ending([&] { run.stop(at_once.get_token()); });
    at_once.request_stop();
    EXPECT_TRUE(comes_true([&] { return run.is_recording_closed(); }))
        << "whatever the pipeline and the devices are at";
    EXPECT_EQ(found_in(dir / "drive.mcap"), std::pair(50, true));
    is_busy.release();
    ending.join();
    EXPECT_TRUE(run.is_a_reader_stuck());
    EXPECT_TRUE(run.are_products_cut());
    EXPECT_EQ(processed, 1);
    EXPECT_EQ(run.packets_left_behind(), 0u);
    let_go.release();
  }
}

}  // namespace
}  // namespace hueline::runtime
