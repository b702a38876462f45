// Recordings of several computers as one: their order, and what was missing in them.
#include "runtime/journal_merge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <set>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "runtime/ingest.hpp"
#include "runtime/ledger.hpp"
#include "storage/journal_writer.hpp"
#include "tests/runtime/sample_packet.hpp"
#include "tests/support/recorded_packets.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::runtime {
namespace {

using storage::JournalHeader;
using testing::ElementsAre;
using testing::HasSubstr;

const JournalHeader kFirst{{{"hueline", "hueline"}, {"pos", "novatel"}, {"laser", "velodyne"}}, {}, {}};
const JournalHeader kSecond{{{"hueline", "hueline"}, {"camera", "genicam"}, {"pos", "novatel"}}, {}, {}};
const JournalHeader kVehicle{
    {{"hueline", "hueline"}, {"pos", "novatel"}, {"laser", "velodyne"}, {"camera", "genicam"}}, {}, {}};
constexpr SensorId kPos = 1, kLaser = 2, kCamera = 3;

/// What a computer of the vehicle records: packets of two sensors, ticks, and a ledger now and then. The byte of each
/// packet says which it is.
std::vector<Packet> recorded(int packets, std::int64_t step_ns, std::size_t room = 100'000) {
  PacketQueue record({room}), pipeline({100'000});
  Ingest ingest({{}, {false}, {true}}, record, pipeline, {100'000});
  std::vector<Packet> out;
  const auto empty = [&] {
    while (record.size() > 0) out.push_back(**record.pop());
  };
  for (int i = 1; i <= packets; ++i) {
    Packet packet = packet_of(static_cast<SensorId>(1 + i % 2), static_cast<std::size_t>(10 + i % 5));
    if (i % 50 == 0) packet = {kSystemSensor, PacketKind::Tick, false, 0, {}, Buffer::copy_of(encode_tick(7))};
    packet.received = host_time_ns(1'000'000 + i * step_ns);
    ingest.submit(std::move(packet));
    if (i % 20 == 0) empty();
    if (i % 100 == 0) ingest.submit_ledger();
  }
  empty();
  ingest.tell_the_rest({});
  empty();
  return out;
}

class JournalMerge : public testing::Test {
 protected:
  void write(const std::string& name, const JournalHeader& header, const std::vector<Packet>& packets,
             const std::function<bool(const Packet&)>& is_lost = {}) {
    storage::JournalWriter::Config config;
    config.if_exists = IfExists::Replace;
    config.chunk_bytes = 4096;
    auto writer = storage::JournalWriter::create(folder_ / name, header, config);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (const Packet& packet : packets) {
      if (is_lost && is_lost(packet)) continue;
      ASSERT_TRUE(writer->append(packet, nanoseconds(0)).ok());
    }
    ASSERT_TRUE(writer->close().ok());
  }

  MergeInput input(const std::string& name, std::vector<std::optional<SensorId>> sensors) {
    auto journal = storage::JournalReader::open(folder_ / name);
    EXPECT_TRUE(journal.ok()) << journal.error().message;
    return {name, std::move(*journal), std::move(sensors), {}, false, false};
  }

  MergedJournal merge() {
    std::vector<MergeInput> inputs;
    inputs.push_back(input("a.mcap", {0, kPos, kLaser}));
    inputs[0].has_ticks = true;
    inputs.push_back(input("b.mcap", {0, kCamera, std::nullopt}));
    auto merged = merge_journals(inputs, kVehicle, folder_ / "c.mcap", {});
    EXPECT_TRUE(merged.ok()) << merged.error().message;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "c.mcap.part"));
    return merged.ok() ? std::move(*merged) : MergedJournal();
  }

  std::vector<Packet> read() {
    std::vector<Packet> out;
    test::for_each_recorded_packet(folder_ / "c.mcap",
                                   [&](const Packet& packet, const JournalHeader&) { out.push_back(packet); });
    return out;
  }
  LedgerCheck check() {
    LedgerCheck out(false);
    for (const Packet& packet : read()) out.take(packet);
    out.finish();
    return out;
  }

  test::TemporaryFolder folder_;
};

TEST_F(JournalMerge, PacketsComeInTheOrderOfTheirTimes) {
  write("a.mcap", kFirst, recorded(1000, 1'000));
  write("b.mcap", kSecond, recorded(700, 1'500));
  const MergedJournal merged = merge();
  const std::vector<Packet> packets = read();
  EXPECT_EQ(merged.packets, packets.size());
  EXPECT_TRUE(std::ranges::is_sorted(packets, {}, &Packet::received));
  std::uint64_t sequence = 0;
  std::vector<std::uint64_t> counts(4);
  for (const Packet& packet : packets) {
    EXPECT_EQ(packet.sequence, sequence++);
    counts[packet.sensor] += packet.kind == PacketKind::Wire;
  }
  EXPECT_THAT(counts, ElementsAre(0u, 480u, 500u, 336u)) << "ticks are the first one's, pos too";
  EXPECT_EQ(std::ranges::count(packets, PacketKind::Tick, &Packet::kind), 20);
  // Two packets at the same time: the first recording's comes first.
  for (std::size_t i = 1; i < packets.size(); ++i) {
    if (packets[i].received == packets[i - 1].received && packets[i].kind == PacketKind::Wire &&
        packets[i - 1].kind == PacketKind::Wire) {
      EXPECT_LT(packets[i - 1].sensor, packets[i].sensor);
    }
  }
  const LedgerCheck verified = check();
  EXPECT_EQ(verified.contradictions(), 0u);
  EXPECT_EQ(verified.missing() + verified.gaps_behind_the_last(), 0u);
  EXPECT_GT(verified.ledgers(), 15u);
}

TEST_F(JournalMerge, WhatIsMissingInOneStaysMissingByName) {
  write("a.mcap", kFirst, recorded(1000, 1'000), [](const Packet& packet) {
    return packet.kind == PacketKind::Wire && packet.sensor == 2 && packet.sequence % 10 == 4;
  });
  write("b.mcap", kSecond, recorded(700, 1'500), [](const Packet& packet) {
    return packet.kind == PacketKind::Wire && packet.sequence > 300 && packet.sequence <= 340;
  });
  const std::vector<Packet> whole_a = recorded(1000, 1'000), whole_b = recorded(700, 1'500);
  const auto lost_a = std::ranges::count_if(whole_a, [](const Packet& packet) {
    return packet.kind == PacketKind::Wire && packet.sensor == 2 && packet.sequence % 10 == 4;
  });
  const auto lost_b = std::ranges::count_if(whole_b, [](const Packet& packet) {
    return packet.kind == PacketKind::Wire && packet.sensor == 1 && packet.sequence > 300 && packet.sequence <= 340;
  });
  const MergedJournal merged = merge();
  EXPECT_EQ(merged.inputs[0].missing, static_cast<std::uint64_t>(lost_a));
  EXPECT_EQ(merged.inputs[1].missing, static_cast<std::uint64_t>(lost_b));
  const LedgerCheck verified = check();
  EXPECT_EQ(verified.contradictions(), 0u);
  EXPECT_EQ(verified.gaps_behind_the_last(), 0u);
  ASSERT_EQ(verified.accounts().size(), 4u);
  EXPECT_EQ(verified.accounts()[kPos].missing, 0u);
  EXPECT_EQ(verified.accounts()[kLaser].missing, static_cast<std::uint64_t>(lost_a));
  EXPECT_EQ(verified.accounts()[kCamera].missing, static_cast<std::uint64_t>(lost_b));
  EXPECT_EQ(verified.accounts()[kCamera].received, 336u);
}

TEST_F(JournalMerge, WhatTheRecorderRefusedStaysRefused) {
  write("a.mcap", kFirst, recorded(1000, 1'000, 15));
  write("b.mcap", kSecond, recorded(700, 1'500));
  merge();
  LedgerCheck own(false);
  test::for_each_recorded_packet(folder_ / "a.mcap",
                                 [&](const Packet& packet, const JournalHeader&) { own.take(packet); });
  own.finish();
  const LedgerCheck verified = check();
  EXPECT_EQ(verified.contradictions() + verified.missing() + verified.gaps_behind_the_last(), 0u);
  for (const SensorId sensor : {kPos, kLaser}) {
    EXPECT_GT(verified.accounts()[sensor].refused, 50u);
    EXPECT_EQ(verified.accounts()[sensor].refused, own.accounts()[sensor].refused);
    EXPECT_EQ(verified.accounts()[sensor].received, own.accounts()[sensor].received);
  }
}

TEST_F(JournalMerge, AGapThatNoLedgerNamesIsToldAtTheEnd) {
  write("a.mcap", kFirst, recorded(1000, 1'000));
  std::vector<Packet> kept = recorded(700, 1'500);
  std::erase_if(kept, [](const Packet& packet) {
    return packet.kind == PacketKind::Ledger || (packet.sequence > 300 && packet.sequence <= 340);
  });
  write("b.mcap", kSecond, kept);
  const std::uint64_t gaps = kept.back().sequence + 1 - kept.size();
  EXPECT_GT(gaps, 40u) << "ledgers have a place in the sequence too";
  const MergedJournal merged = merge();
  EXPECT_EQ(merged.inputs[1].ledgers, 0u);
  EXPECT_EQ(merged.inputs[1].unexplained, gaps);
  const LedgerCheck verified = check();
  EXPECT_EQ(verified.contradictions() + verified.missing(), 0u);
  EXPECT_EQ(verified.gaps_behind_the_last(), gaps);
  const Packet last = read().back();
  const auto fault = decode_fault(last.sensor, last.received, last.bytes.bytes());
  ASSERT_TRUE(fault.ok());
  EXPECT_EQ(fault->count, gaps);
  EXPECT_THAT(fault->detail, HasSubstr("b.mcap"));
}

TEST_F(JournalMerge, ARecordingThatWasCutEndsAndTheOthersGoOn) {
  write("a.mcap", kFirst, recorded(1000, 1'000));
  write("b.mcap", kSecond, recorded(700, 1'500));
  std::filesystem::resize_file(folder_ / "b.mcap", std::filesystem::file_size(folder_ / "b.mcap") / 2);
  const MergedJournal merged = merge();
  EXPECT_TRUE(merged.inputs[0].end.ok());
  EXPECT_EQ(merged.inputs[1].end.error().code, ErrorCode::Truncated);
  EXPECT_EQ(merged.inputs[0].packets, recorded(1000, 1'000).size() - 11);  // its ledgers are written anew
  std::size_t told = 0;
  for (const Packet& packet : read())
    if (packet.kind == PacketKind::Fault && packet.sensor == kSystemSensor)
      told += decode_fault(packet.sensor, packet.received, packet.bytes.bytes())->detail.starts_with("b.mcap");
  EXPECT_EQ(told, 1u);
  EXPECT_EQ(check().contradictions(), 0u);
}

TEST_F(JournalMerge, ADamagedChunkIsMissingByName) {
  write("a.mcap", kFirst, recorded(1000, 1'000));
  write("b.mcap", kSecond, recorded(700, 1'500));
  std::string bytes = test::contents(folder_ / "b.mcap");
  bytes[bytes.size() / 2] = static_cast<char>(~bytes[bytes.size() / 2]);
  test::write_file(folder_ / "b.mcap", bytes);
  const MergedJournal merged = merge();
  EXPECT_GE(merged.inputs[1].damages, 1u);
  const LedgerCheck verified = check();
  EXPECT_EQ(verified.contradictions() + verified.gaps_behind_the_last(), 0u);
  EXPECT_GT(verified.accounts()[kCamera].missing, 5u);
  EXPECT_EQ(verified.accounts()[kLaser].missing, 0u);
  EXPECT_EQ(verified.accounts()[kCamera].received, 336u);
}

TEST_F(JournalMerge, RandomDamageNeverContradicts) {
  write("a.mcap", kFirst, recorded(1000, 1'000));
  const std::vector<Packet> other = recorded(700, 1'500);
  write("b.mcap", kSecond, other);
  const std::string whole = test::contents(folder_ / "b.mcap");
  std::uint32_t random = 1;
  const auto next = [&] { return random = random * 1664525u + 1013904223u; };
  for (int i = 0; i < 60; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 3; ++k) bytes[4000 + next() % (bytes.size() - 4000)] ^= static_cast<char>(1 + next() % 255);
    if (i % 3 == 0) bytes.resize(4000 + next() % (bytes.size() - 4000));
    test::write_file(folder_ / "b.mcap", bytes);
    const MergedJournal merged = merge();
    const LedgerCheck verified = check();
    EXPECT_EQ(verified.contradictions(), 0u) << i;
    EXPECT_EQ(verified.accounts()[kLaser].missing + verified.accounts()[kPos].missing, 0u) << i;
    EXPECT_EQ(verified.accounts()[kLaser].here, 500u) << i;
    EXPECT_LE(verified.accounts()[kCamera].received, 336u) << i;
    EXPECT_EQ(verified.gaps_behind_the_last(), merged.inputs[1].unexplained) << i;
  }
}

TEST_F(JournalMerge, AStoppedMergeLeavesNothing) {
  write("a.mcap", kFirst, recorded(1000, 1'000));
  write("b.mcap", kSecond, recorded(700, 1'500));
  std::stop_source stop;
  stop.request_stop();
  std::vector<MergeInput> inputs;
  inputs.push_back(input("a.mcap", {0, kPos, kLaser}));
  inputs[0].has_ticks = true;
  inputs.push_back(input("b.mcap", {0, kCamera, std::nullopt}));
  const auto merged = merge_journals(inputs, kVehicle, folder_ / "c.mcap", stop.get_token());
  ASSERT_FALSE(merged.ok());
  EXPECT_EQ(merged.error().code, ErrorCode::Stopped);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c.mcap"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c.mcap.part"));
}

}  // namespace
}  // namespace hueline::runtime
