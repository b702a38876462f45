#include "runtime/ledger.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "runtime/ingest.hpp"
#include "tests/runtime/sample_packet.hpp"

namespace hueline::runtime {
namespace {

constexpr SensorId kPos = 1, kLaser = 2;

/// What a capture records: two sensors, with a ledger after every 100 packets and at the end. The recorder's queue
/// holds `room` packets and is emptied after every 20.
std::vector<PacketPtr> recorded(std::size_t room, std::size_t packets = 1000) {
  PacketQueue record({room}), pipeline({100'000});
  Ingest ingest({{}, {false}, {true}}, record, pipeline, {100'000});
  std::vector<PacketPtr> out;
  const auto empty = [&] {
    while (record.size() > 0) out.push_back(*record.pop());
  };
  for (std::size_t i = 1; i <= packets; ++i) {
    ingest.submit(packet_of(i % 3 == 0 ? kPos : kLaser, 10 + i % 7));
    if (i % 20 == 0) empty();
    if (i % 100 == 0) ingest.submit_ledger();
  }
  empty();
  ingest.tell_the_rest({});
  empty();
  return out;
}

LedgerCheck checked(const std::vector<PacketPtr>& packets, bool begins_late = false) {
  LedgerCheck check(begins_late);
  for (const PacketPtr& packet : packets) check.take(*packet);
  check.finish();
  return check;
}

std::uint64_t of_sensor(const std::vector<PacketPtr>& packets, SensorId sensor) {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(packets, [&](const PacketPtr& packet) { return packet->sensor == sensor; }));
}

TEST(Ledger, ProvesThatAllThatEnteredIsThere) {
  const auto packets = recorded(100'000);
  const LedgerCheck check = checked(packets);
  EXPECT_EQ(check.ledgers(), 11u);
  EXPECT_EQ(check.contradictions(), 0u);
  EXPECT_EQ(check.behind_the_last(), 1u) << "the ledger itself";
  ASSERT_EQ(check.accounts().size(), 3u);
  EXPECT_EQ(check.accounts()[kPos].received, 333u);
  EXPECT_EQ(check.accounts()[kLaser].received, 667u);
  for (const auto& one : check.accounts()) {
    EXPECT_EQ(one.here, one.received);
    EXPECT_EQ(one.refused + one.missing + one.removed, 0u);
  }
}

TEST(Ledger, CountsWhatTheRecorderRefused) {
  const auto packets = recorded(15);
  const LedgerCheck check = checked(packets);
  EXPECT_EQ(check.contradictions(), 0u);
  EXPECT_EQ(check.missing(), 0u);
  EXPECT_EQ(check.removed(), 0u);
  const auto &pos = check.accounts()[kPos], &laser = check.accounts()[kLaser];
  EXPECT_EQ(pos.here + pos.refused_wire, 333u + (pos.here - pos.wire));
  EXPECT_EQ(laser.wire + laser.refused_wire, 667u);
  EXPECT_GT(laser.refused_wire, 100u);
  // The faults in the recording tell the same number.
  std::uint64_t told = 0;
  for (const PacketPtr& packet : packets) {
    if (packet->kind != PacketKind::Fault || packet->sensor != kLaser) continue;
    const auto fault = decode_fault(packet->sensor, packet->received, packet->bytes.bytes());
    ASSERT_TRUE(fault.ok());
    ASSERT_TRUE(Ingest::is_refusal(*fault));
    told += fault->count;
  }
  EXPECT_EQ(told, laser.refused_wire);
}

TEST(Ledger, SaysOfWhichSensorWhatIsMissingWas) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    auto packets = recorded(trial % 2 == 0 ? 100'000 : 15);
    const auto whole = packets;
    // A lost chunk in the middle, and one packet elsewhere; not behind the last ledger.
    const auto at = static_cast<std::ptrdiff_t>(random() % (packets.size() - 120));
    packets.erase(packets.begin() + at, packets.begin() + at + 1 + static_cast<std::ptrdiff_t>(random() % 110));
    if (packets.size() > 10)
      packets.erase(packets.begin() + static_cast<std::ptrdiff_t>(random() % (packets.size() / 2)));
    const LedgerCheck check = checked(packets);
    EXPECT_EQ(check.contradictions(), 0u);
    for (const SensorId sensor : {kSystemSensor, kPos, kLaser}) {
      const auto& one = check.accounts()[sensor];
      EXPECT_EQ(one.missing, of_sensor(whole, sensor) - of_sensor(packets, sensor)) << "sensor " << sensor;
      EXPECT_EQ(one.received, checked(whole).accounts()[sensor].received);
      EXPECT_EQ(one.received, one.here + one.refused + one.missing + one.removed);
    }
  }
}

TEST(Ledger, CountsWhatCameBeforeALaterBeginning) {
  auto packets = recorded(100'000);
  packets.erase(packets.begin(), packets.begin() + 250);
  EXPECT_EQ(checked(packets).missing(), 250u) << "nothing may be missing at the beginning";
  const LedgerCheck check = checked(packets, true);
  EXPECT_EQ(check.missing(), 0u);
  EXPECT_EQ(check.removed(), 250u);
  EXPECT_EQ(check.contradictions(), 0u);
}

TEST(Ledger, KnowsWhatARingHasRemovedByItsNumber) {
  const auto whole = recorded(100'000);
  auto packets = whole;
  packets.erase(packets.begin() + 150, packets.begin() + 480);
  LedgerCheck ring(false);
  for (const PacketPtr& packet : packets) ring.take(*packet);
  ring.finish(330);
  EXPECT_EQ(ring.missing(), 0u);
  EXPECT_EQ(ring.removed(), 330u);
  EXPECT_EQ(ring.accounts()[kLaser].removed, of_sensor(whole, kLaser) - of_sensor(packets, kLaser));
  // One more is missing: it is not known which of all these it is.
  packets.erase(packets.begin() + 10);
  LedgerCheck lost(false);
  for (const PacketPtr& packet : packets) lost.take(*packet);
  lost.finish(330);
  EXPECT_EQ(lost.missing(), 331u);
}

TEST(Ledger, ProvesOfACutEndTheSequenceAlone) {
  auto packets = recorded(100'000);
  packets.resize(555);
  const LedgerCheck check = checked(packets);
  EXPECT_EQ(check.missing(), 0u);
  EXPECT_EQ(check.ledgers(), 5u);
  EXPECT_EQ(check.behind_the_last(), 555u - 504u) << "the fifth ledger is the packet number 504";
  EXPECT_EQ(check.gaps_behind_the_last(), 0u);
  packets.erase(packets.begin() + 530);
  EXPECT_EQ(checked(packets).gaps_behind_the_last(), 1u);
}

TEST(Ledger, NoticesPacketsThatWereChanged) {
  const auto whole = recorded(100'000);
  for (const auto& change : std::initializer_list<std::function<void(std::vector<PacketPtr>&)>>{
           [](auto& packets) { packets.insert(packets.begin() + 50, packets[50]); },
           [](auto& packets) {
             Packet other = *packets[50];
             other.bytes = Buffer::copy_of(std::vector<std::byte>(other.bytes.size() + 1));
             packets[50] = std::make_shared<const Packet>(std::move(other));
           },
           [](auto& packets) {
             Packet other = *packets[50];
             other.sensor = other.sensor == kPos ? kLaser : kPos;
             packets[50] = std::make_shared<const Packet>(std::move(other));
           }}) {
    auto packets = whole;
    change(packets);
    EXPECT_EQ(checked(packets).contradictions(), 1u);
  }
}

TEST(Ledger, RefusesBytesThatAreNone) {
  const Ledger ledger{{{1, 2, 3, 4, 5, 6}, {~std::uint64_t{0}, 8, 9, 10, 11, 12}}};
  const auto bytes = encode_ledger(ledger);
  const auto again = decode_ledger(bytes);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(*again, ledger);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_EQ(decode_ledger(std::span(bytes).first(size)).error().code, ErrorCode::Malformed) << size;
  auto longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_EQ(decode_ledger(longer).error().code, ErrorCode::Malformed);
  auto later = bytes;
  later[0] = std::byte{2};
  EXPECT_EQ(decode_ledger(later).error().code, ErrorCode::Unsupported);
}

}  // namespace
}  // namespace hueline::runtime
