#include "runtime/ingest.hpp"

#include <gtest/gtest.h>

#include "tests/runtime/sample_packet.hpp"

namespace hueline::runtime {
namespace {

constexpr SensorId kPos = 1, kLaser = 2;

struct Bench {
  Bench(PacketQueue::Limits record_limits, PacketQueue::Limits pipeline_limits)
      : record(record_limits),
        pipeline(pipeline_limits),
        ingest({{}, {false}, {true}}, record, pipeline, pipeline_limits) {}
  PacketQueue record, pipeline;
  Ingest ingest;
};

std::vector<PacketPtr> drain(PacketQueue& queue) {
  queue.close();
  std::vector<PacketPtr> out;
  while (auto packet = queue.pop()) out.push_back(*packet);
  return out;
}

TEST(Ingest, GivesBothQueuesTheSamePacketsInOneOrder) {
  Bench bench({100}, {100});
  for (int i = 0; i < 10; ++i) bench.ingest.submit(packet_of(i % 2 ? kPos : kLaser));
  const auto recorded = drain(bench.record), processed = drain(bench.pipeline);
  ASSERT_EQ(recorded.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(recorded[i]->sequence, i);
    EXPECT_EQ(recorded[i], processed[i]) << "shared, not copied";
  }
}

TEST(Ingest, ShedsLasersBeforePositionsAndRecordsTheDecision) {
  Bench bench({1000}, {8});
  for (int i = 0; i < 10; ++i) bench.ingest.submit(packet_of(kLaser));
  for (int i = 0; i < 4; ++i) bench.ingest.submit(packet_of(kPos));
  const auto recorded = drain(bench.record), processed = drain(bench.pipeline);
  ASSERT_EQ(recorded.size(), 14u) << "everything is recorded";
  std::size_t lasers = 0, positions = 0;
  for (const auto& p : processed) (p->sensor == kLaser ? lasers : positions) += 1;
  EXPECT_EQ(lasers, 6u);
  EXPECT_EQ(positions, 2u) << "room for two is left once lasers stop at three quarters";
  std::vector<PacketPtr> not_shed;
  for (const auto& p : recorded)
    if (!p->shed) not_shed.push_back(p);
  EXPECT_EQ(not_shed, processed) << "the record says exactly what the pipeline saw";
  EXPECT_EQ(bench.ingest.counts(kLaser).shed, 4u);
}

TEST(Ingest, WhatTheRecorderRefusesIsNotFusedAndIsTold) {
  Bench bench({3}, {100});
  for (int i = 0; i < 5; ++i) bench.ingest.submit(packet_of(kLaser));
  EXPECT_EQ(bench.ingest.counts(kLaser).refused, 2u);
  EXPECT_EQ(bench.pipeline.size(), 3u);
  bench.record.pop();
  bench.record.pop();
  EXPECT_TRUE(bench.ingest.submit(packet_of(kPos)));
  const auto recorded = drain(bench.record);
  ASSERT_EQ(recorded.size(), 3u);
  const auto fault = decode_fault(recorded[1]->sensor, recorded[1]->received, recorded[1]->bytes.bytes());
  ASSERT_TRUE(fault.ok());
  EXPECT_EQ(recorded[1]->sensor, kLaser);
  EXPECT_EQ(fault->kind, FaultKind::Overflow);
  EXPECT_EQ(fault->count, 2u);
  EXPECT_EQ(recorded[1]->sequence, 5u) << "the refused two leave the gap 3, 4";
}

Fault fault_in(const Packet& packet) {
  EXPECT_EQ(packet.kind, PacketKind::Fault);
  return *decode_fault(packet.sensor, packet.received, packet.bytes.bytes());
}

TEST(Ingest, AStampThatCannotBeIsTheArrivalAndIsTold) {
  using std::chrono::hours;
  Bench bench({1000}, {1000});
  const HostTime now = host_time_ns(5'000'000'000'000);
  const auto submit = [&](HostTime received) {
    Packet packet = packet_of(kPos, 24);
    packet.received = received;
    bench.ingest.submit(std::move(packet), now);
  };
  submit(now - std::chrono::milliseconds(3));
  submit(now + hours(400'000));
  submit(host_time_ns(INT64_MIN));
  submit(now + std::chrono::microseconds(300));
  bench.ingest.tell_the_rest({});
  const auto recorded = drain(bench.record);
  ASSERT_EQ(recorded.size(), 7u);
  EXPECT_EQ(recorded[0]->received, now - std::chrono::milliseconds(3));
  EXPECT_EQ(fault_in(*recorded[1]).kind, FaultKind::ClockStep);
  EXPECT_EQ(recorded[2]->received, now);
  EXPECT_EQ(recorded[3]->received, now);
  EXPECT_EQ(recorded[4]->received, now + std::chrono::microseconds(300));
  EXPECT_EQ(fault_in(*recorded[5]).count, 1u) << "of the same trouble: told with the end";
  EXPECT_LE(recorded[5]->received, now);
  EXPECT_EQ(recorded[6]->kind, PacketKind::Ledger);
}

TEST(Ingest, AFloodOfFaultsIsRecordedAtThePromisedRateAndNoUnitOfItIsLost) {
  Bench bench({100'000}, {100'000});
  std::uint64_t wires = 0;
  for (int i = 0; i < 40'000; ++i) {  // 8 s
    const HostTime now = host_time_ns(1'000'000'000 + i * 200'000ll);
    const Fault fault{kLaser, FaultKind::Malformed, now, 2, "a datagram was cut off"};
    Packet packet{kLaser, PacketKind::Fault, false, 0, now, Buffer::copy_of(encode_fault(fault))};
    if (i % 2)
      bench.ingest.submit(std::move(packet), now);  // from a source
    else
      bench.ingest.submit(fault);  // from a reader
    if (i % 10 == 0) bench.ingest.submit(packet_of(kPos), now), ++wires;
  }
  bench.ingest.tell_the_rest({});
  std::uint64_t faults = 0, count = 0;
  for (const auto& packet : drain(bench.record)) {
    if (packet->kind != PacketKind::Fault) continue;
    ++faults;
    count += fault_in(*packet).count;
  }
  EXPECT_LE(faults, 10u);
  EXPECT_EQ(count, 80'000u);
}

TEST(Ingest, AFaultThatTheRecorderRefusedIsToldLater) {
  Bench bench({2}, {100});
  bench.ingest.submit(packet_of(kPos));
  bench.ingest.submit(packet_of(kPos));
  bench.ingest.submit(Fault{kLaser, FaultKind::Overflow, host_time_ns(1), 7, "pool full"});
  bench.record.pop();
  bench.record.pop();
  EXPECT_TRUE(bench.ingest.tell_the_rest({}));
  const auto recorded = drain(bench.record);
  ASSERT_EQ(recorded.size(), 2u);
  EXPECT_EQ(fault_in(*recorded[0]).count, 7u);
  EXPECT_EQ(recorded[1]->kind, PacketKind::Ledger);
}

TEST(Ingest, WhatADecoderActsOnIsNotHeldBack) {
  Bench bench({100}, {100});
  for (int i = 0; i < 5; ++i) {
    bench.ingest.submit(Fault{kPos, FaultKind::Disconnected, host_time_ns(i), 1, "hung up"});
    bench.ingest.submit(Fault{kPos, FaultKind::Reconnected, host_time_ns(i), 1, "open again"});
  }
  EXPECT_EQ(bench.record.size(), 10u);
}

}  // namespace
}  // namespace hueline::runtime
