#include "runtime/summary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/runtime/sample_packet.hpp"

namespace hueline::runtime {
namespace {

TEST(Summary, CountsPointsLossesAndGaps) {
  Summary summary({"hueline", "pos", "laser"});
  Packet packet;
  packet.sensor = 2;
  packet.bytes = Buffer::copy_of(std::vector<std::byte>(100));
  for (const std::uint64_t sequence : {0u, 1u, 4u}) {
    packet.sequence = sequence;
    packet.shed = sequence == 4;
    summary.on_packet(packet);
  }
  CloudBlock block;
  block.points.resize(4);
  block.points[0].state = ColourState::Direct;
  block.points[1].state = ColourState::Neighbour;
  block.points[2].state = ColourState::Outside;
  summary.on_cloud(block, fusion::Trajectory({}));
  summary.on_fault({2, FaultKind::Lost, {}, 7, "time gap of 9.3 ms"});
  summary.on_fault({2, FaultKind::Lost, {}, 3, "time gap of 4.0 ms"});
  summary.on_fault({2, FaultKind::NoTime, {}, 1, "x"});

  summary.on_sync_state({}, 1, SyncState::Acquiring);

  const auto json = summary.json();
  EXPECT_TRUE(json["clocks"][0]["time"].is_null()) << "there is no GPS time yet";
  EXPECT_EQ(json["points"]["total"], 4);
  EXPECT_EQ(json["points"]["coloured_share"], 0.5);
  EXPECT_EQ(json["journal"]["sequence_gaps"], 2);
  EXPECT_EQ(json["sensors"][2]["shed"], 1);
  EXPECT_EQ(json["sensors"][2]["bytes"], 300);
  EXPECT_EQ(json["sensors"][2]["faults"][0]["count"], 10);
  EXPECT_EQ(json["sensors"][2]["faults"][0]["first"], "time gap of 9.3 ms");
  EXPECT_EQ(summary.lost(FaultKind::Lost), 10u);
  EXPECT_THAT(summary.text(), ::testing::HasSubstr("Lost x10"));
}

TEST(Summary, OfALiveRunTellsTheShedPacketsThatAReplaySees) {
  // The pipeline takes nothing: its queue holds two packets.
  PacketQueue record({1000}), pipeline({2});
  Ingest ingest({{}, {false}, {true}}, record, pipeline, {2});
  for (int i = 0; i < 20; ++i) {
    ingest.submit(packet_of(i % 3 == 0 ? 1 : 2, static_cast<std::size_t>(100 + i)));
    if (i == 15) pipeline.pop();
  }
  Summary live({"hueline", "pos", "laser"}), replay({"hueline", "pos", "laser"});
  record.close();
  while (const auto packet = record.pop()) {
    replay.on_packet(**packet);
    if (!(*packet)->shed) live.on_packet(**packet);
  }
  EXPECT_NE(live.json(), replay.json());
  for (const SensorId sensor : {kSystemSensor, SensorId{1}, SensorId{2}}) live.on_shed(sensor, ingest.shed(sensor));
  EXPECT_EQ(live.json(), replay.json());
  EXPECT_GT(replay.json()["sensors"][2]["shed"], 10);
}

TEST(Summary, HoldsNoMoreThanItSaysHoweverASourceLies) {
  Summary summary({"hueline", "pos"});
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    InsSolution solution;
    solution.status = 1000 + i;
    solution.time = gps_time_ns(1'400'000'000'000'000'000 + std::int64_t{10'000'000} * i);
    summary.on_solution(solution);
    summary.on_sync_state(solution.time, 1, i % 2 ? SyncState::Locked : SyncState::Holdover);
  }
  const auto json = summary.json();
  EXPECT_EQ(json["clocks"].size(), 10'000u);
  EXPECT_EQ(json["clock_changes_not_listed"], 10'000);
  std::uint64_t told = 0;
  for (const auto& [status, solutions] : json["drive"]["not_good"].items()) told += solutions.get<std::uint64_t>();
  EXPECT_EQ(told, 20'000u);
  EXPECT_LE(json["drive"]["not_good"].size(), 65u);
  EXPECT_THAT(summary.text(), ::testing::HasSubstr("10000 later changes of clocks are not listed"));
}

TEST(Summary, SaysASensorWithoutPacketsAndHowLongTheReceiverSaidWhat) {
  Summary summary({"hueline", "pos", "laser"});
  for (int i = 0; i <= 100; ++i) {
    InsSolution solution;
    solution.time = gps_time_ns(1'400'000'000'000'000'000 + std::int64_t{100'000'000} * i);
    solution.status = i < 40 ? 1 : 7;
    summary.on_solution(solution);
  }
  summary.on_returns(10);
  summary.on_unfused("no pose: x", 10);
  const std::string text = summary.text();
  EXPECT_THAT(text, ::testing::HasSubstr("laser      no packet came"));
  EXPECT_THAT(text, ::testing::HasSubstr("40 POS solutions not used, 3.9 s; the receiver says: aligning"));
  EXPECT_THAT(text, ::testing::HasSubstr("61 POS solutions not used, 6.1 s; the receiver says: alignment complete"));
  EXPECT_EQ(summary.json()["points"]["returns"], 10);
}

}  // namespace
}  // namespace hueline::runtime
