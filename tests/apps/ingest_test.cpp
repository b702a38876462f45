#include "apps/ingest.hpp"

#include <gtest/gtest.h>

namespace hueline::apps {
namespace {

constexpr SensorId kPos = 1, kLaser = 2;

Packet packet_of(SensorId sensor, std::size_t size = 100) {
  Packet packet;
  packet.sensor = sensor;
  packet.bytes = Buffer::copy_of(std::vector<std::byte>(size));
  return packet;
}

struct Bench {
  Bench(PacketQueue::Limits record_limits, PacketQueue::Limits pipeline_limits)
      : record(record_limits), pipeline(pipeline_limits), ingest({{}, {false}, {true}}, record, pipeline, pipeline_limits) {}
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

}  // namespace
}  // namespace hueline::apps
