#include "console/server/alarms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace hueline::console {
namespace {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::IsEmpty;

ordered_json trouble(const char* what, const char* level) {
  return {{"trouble", what}, {"level", level}, {"cause", "sends nothing"}};
}
using Troubles = std::vector<ordered_json>;
ordered_json status_with(const Troubles& of_drive, const Troubles& of_laser) {
  const ordered_json laser{{"name", "laser"}, {"troubles", of_laser}};
  return {{"troubles", of_drive}, {"sensors", std::vector{laser}}};
}
const Troubles kNone;

/// Takes what an Alarms tells.
struct Told {
  Alarms alarms;
  std::vector<std::pair<bool, std::uint64_t>> changes;
  Told() {
    alarms.on_change = [this](bool is_alarm, std::uint64_t warnings) { changes.emplace_back(is_alarm, warnings); };
  }
  std::vector<std::pair<bool, std::uint64_t>> take() { return std::exchange(changes, {}); }
};

TEST(Alarms, LastUntilTheyAreOverOrAcknowledged) {
  Told told;
  const ordered_json gone = status_with(kNone, {trouble("gone", "alarm")}), well = status_with(kNone, kNone);
  told.alarms.take(well);
  EXPECT_THAT(told.take(), IsEmpty());
  told.alarms.take(gone);
  told.alarms.take(gone);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 0u)));
  told.alarms.take(well);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(false, 0u)));

  told.alarms.take(gone);
  told.alarms.acknowledge("laser gone alarm");
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 0u), std::pair(false, 0u)));
  EXPECT_THAT(told.alarms.acknowledged_json(), ElementsAre("laser gone alarm"));
  told.alarms.take(gone);
  EXPECT_THAT(told.take(), IsEmpty()) << "it is acknowledged";
  told.alarms.take(status_with({trouble("disk_full", "alarm")}, {trouble("gone", "alarm")}));
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 0u))) << "another one";
  told.alarms.acknowledge("drive disk_full alarm");
  told.alarms.take(well);
  told.take();
  EXPECT_THAT(told.alarms.acknowledged_json(), IsEmpty());
  told.alarms.take(gone);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 0u))) << "it comes again, so it is new";
}

TEST(Alarms, CountWarningsThatBegin) {
  Told told;
  const ordered_json late = status_with(kNone, {trouble("late", "warning"), trouble("starting", "waiting")});
  told.alarms.take(late);
  told.alarms.take(late);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(false, 1u)));
  told.alarms.take(status_with(kNone, {trouble("late", "alarm")}));  // it has become worse
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 1u)));
  told.alarms.take(late);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(false, 2u)));
}

TEST(Alarms, AreToldOnceWithTheWarningsThatBeginWithThem) {
  Told told;
  const ordered_json both = status_with(kNone, {trouble("gone", "alarm"), trouble("late", "warning")});
  told.alarms.take(both);
  told.alarms.take(both);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 1u)));
}

TEST(Alarms, OfTheConsoleOutliveTheDriveUntilSomebodyHasSeenThem) {
  Told told;
  told.alarms.take(status_with(kNone, {trouble("gone", "alarm")}));
  told.alarms.set(Alarms::kSilent, true);
  told.alarms.set(Alarms::kEnded, true);
  told.alarms.end_drive();
  EXPECT_THAT(told.take(), ElementsAre(std::pair(true, 0u)));
  EXPECT_FALSE(told.alarms.has(Alarms::kSilent));
  EXPECT_TRUE(told.alarms.has(Alarms::kEnded));
  told.alarms.acknowledge(Alarms::kEnded);
  EXPECT_THAT(told.take(), ElementsAre(std::pair(false, 0u)));
  EXPECT_FALSE(told.alarms.has(Alarms::kEnded));
}

TEST(Alarms, TakeWhateverTheFeedSends) {
  Told told;
  for (const char* text :
       {"null", "[]", "7", "{}", R"({"troubles": 3, "sensors": {"a": 1}})",
        R"({"troubles": [1, null, {"level": 5}], "sensors": [null, {"troubles": "x"}, {"name": 2}]})"})
    told.alarms.take(ordered_json::parse(text));
  told.alarms.take(ordered_json(ordered_json::value_t::discarded));
  told.alarms.acknowledge("nothing like this");
  EXPECT_THAT(told.take(), IsEmpty());
  EXPECT_THAT(told.alarms.acknowledged_json(), IsEmpty());
}

}  // namespace
}  // namespace hueline::console
