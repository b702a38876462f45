#include "apps/outputs.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <map>

#include "core/calendar.hpp"
#include "storage/mcap_reader.hpp"

namespace hueline::apps {
namespace {

/// A drive's folder that goes with the test.
struct Folder {
  std::filesystem::path path;
  Folder() {
    char name[] = "/tmp/hueline_outputs_XXXXXX";
    path = mkdtemp(name);
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

config::Rig rig() {
  return config::parse_rig(
      "rig: r\nsensors:\n  - {name: pps, driver: pps, device: /dev/pps0}\n"
      "  - {name: pos, driver: novatel, tcp: {host: h, port: 3001}, logs: {}}\ncolouring: {method: lens}\n",
      "rig");
}

InsSolution solution(double seconds) {
  InsSolution s;
  s.sensor = 2;
  s.time = from_gps_week(2400, from_seconds(seconds));
  s.position = {0.84, 0.2, 570};
  s.is_good = true;
  return s;
}

TEST(Outputs, TheViewBeginsWithTheFirstPoseAndKnowsWhatWasSaidBefore) {
  Folder folder;
  auto outputs = Outputs::create(rig(), folder.path);
  ASSERT_TRUE(outputs.ok());
  Outputs& out = **outputs;
  out.on_fault({2, FaultKind::Disconnected, {}, 1, "no route"});
  out.on_sync_state({}, 1, SyncState::Acquiring);
  out.on_origin(solution(100).position);
  for (int i = 0; i < 5; ++i) out.on_solution(solution(100 + i));
  // No point was ever coloured.
  ASSERT_TRUE(out.finish().ok());

  auto reader = storage::McapReader::open(folder.path / "view.mcap");
  ASSERT_TRUE(reader.ok());
  std::map<std::string, int> messages;
  std::uint64_t earliest = ~std::uint64_t{0};
  for (;;) {
    auto message = reader->next();
    if (!message.ok()) break;
    ++messages[reader->channels().at(message->channel).topic];
    earliest = std::min(earliest, message->log_time);
  }
  EXPECT_EQ(messages["/pose"], 5);
  EXPECT_EQ(messages["/log"], 2);
  EXPECT_GT(earliest, 1'600'000'000'000'000'000u) << "something was shown in 1980";
}

}  // namespace
}  // namespace hueline::apps
