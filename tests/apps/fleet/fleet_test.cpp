#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "apps/exit_code.hpp"
#include "apps/fleet/catalogue.hpp"
#include "apps/fleet/catalogue_page.hpp"
#include "apps/fleet/coverage_map.hpp"
#include "apps/fleet/fleet.hpp"
#include "apps/fleet/geopackage.hpp"
#include "apps/fleet/line.hpp"
#include "apps/fleet/plan.hpp"
#include "apps/fleet/postgres.hpp"
#include "apps/fleet/state.hpp"
#include "apps/fleet/submit.hpp"
#include "apps/fleet/task.hpp"
#include "apps/sha256.hpp"
#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::apps {
namespace {

using test::contents;
using test::TemporaryFolder;
using test::write_file;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// A folder with drives whose recordings are short texts: a plan and a task know only their bytes.
class Fleet : public ::testing::Test {
 protected:
  void add_drive(const std::string& name, const std::string& bytes) {
    fs::create_directories(folder_ / name);
    write_file(folder_ / name / "drive.mcap", bytes);
    wish_.drives.push_back((folder_ / name).string());
  }
  FleetPlan plan() {
    auto made = make_plan(wish_, folder_ / "plan.json");
    if (!made.ok()) throw std::runtime_error(made.error().message);
    return *made;
  }
  /// A replay that copies the recording: its products follow from its input.
  Replayer copier(int status = kDone) {
    return [this, status](const std::vector<std::string>& words, const fs::path& log, const std::stop_token&) {
      ++replays_;
      const fs::path out = words.at(2);
      write_file(log, "12:00:00 info begins\n12:00:01 error something was wrong\n");
      write_file(out / "cloud.las", "cloud of " + contents(words.at(0)));
      write_file(out / "summary.json", R"({"verdict": {"grade": "good"}})");
      return Result<int>(status);
    };
  }
  Result<TaskResult> do_first(const FleetPlan& plan, const Replayer& replay) {
    return do_task(plan, plan.tasks.front(), replay, {});
  }
  /// Names of everything in the folder of the results.
  std::set<std::string> left(const FleetPlan& plan) {
    std::set<std::string> out;
    for (const auto& entry : fs::directory_iterator(plan.results())) out.insert(entry.path().filename().string());
    return out;
  }

  const TemporaryFolder folder_;
  FleetWish wish_{{}, {}, {}, {}, "gps", {}};
  std::atomic<int> replays_{0};
};

TEST(Sha256, IsThatOfThePublishedVectors) {
  const TemporaryFolder folder;
  // FIPS 180-4 examples: one block, and a million times "a".
  write_file(folder / "abc", "abc");
  EXPECT_EQ(*sha256_of(folder / "abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  write_file(folder / "empty", "");
  EXPECT_EQ(*sha256_of(folder / "empty"), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  write_file(folder / "a", std::string(1'000'000, 'a'));
  EXPECT_EQ(*sha256_of(folder / "a"), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_EQ(sha256_of(folder / "none").error().code, ErrorCode::Io);
}

TEST(Sha256, OfATextIsThatOfItsFile) {
  EXPECT_EQ(sha256_of_text("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(GeoPackage, KeepsEveryValueAndTellsWhatItCannotWrite) {
  const auto made = [](const std::string& name) {
    GeoPackage out;
    out.add_lines({"drives", "it's about \"drives\"", {{"name", ColumnType::Text}, {"size", ColumnType::Real}}});
    EXPECT_EQ(out.add_line("drives", {}, {name, 1.5}), 1);
    EXPECT_EQ(out.add_line("drives", {{0.5, -1.5, 100}}, {TableValue(), TableValue()}), 2);
    return *out.bytes("2026-11-23T00:00:00.000Z");
  };
  const std::string bytes = made("x'); DROP TABLE drives; --");
  EXPECT_EQ(bytes.substr(0, 15), "SQLite format 3");
  EXPECT_THAT(bytes, HasSubstr("x'); DROP TABLE drives; --"));
  EXPECT_EQ(bytes, made("x'); DROP TABLE drives; --")) << "the same rows give the same bytes";
  EXPECT_NE(bytes, made("y"));
  GeoPackage wrong;
  wrong.add_row("nowhere", {std::int64_t{1}});
  const auto none = wrong.bytes("");
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, HasSubstr("no such table: nowhere"));
}

TEST(Line, GoesOnAcrossTheDateLine) {
  const auto at = [](double longitude_deg) { return Geodetic{-0.3, longitude_deg * kRadPerDeg, 0}; };
  const auto east = line_of({at(179.5), at(-179.5), at(179.75)}), west = line_of({at(-179.5), at(179.5), at(179)});
  ASSERT_EQ(east.size(), 3u);
  EXPECT_NEAR(east[1].first, 180.5, 1e-9);
  EXPECT_NEAR(east[2].first, 179.75, 1e-9);
  EXPECT_NEAR(west[1].first, -180.5, 1e-9);
  EXPECT_NEAR(west[2].first, -181, 1e-9);
  EXPECT_EQ(line_of({at(12)}).size(), 2u);
}

TEST(PostgresAddress, IsShownWithoutItsPassword) {
  const auto shown = [](const std::string& uri) {
    const auto address = PostgresAddress::parse(uri);
    EXPECT_TRUE(address.ok()) << uri;
    return address.ok() ? address->shown() : address.error().message;
  };
  EXPECT_EQ(shown("postgresql://host/fleet"), "postgresql://host/fleet");
  EXPECT_EQ(shown("postgres://me:secret@host:5433/fleet?sslmode=require"), "postgresql://me@host:5433/fleet");
  EXPECT_EQ(shown("postgresql://me:se%40c%2Fret@[::1]/fleet"), "postgresql://me@::1/fleet");
  EXPECT_EQ(shown("postgresql://me:sec?ret@host/fleet"), "postgresql://me@host/fleet");
  EXPECT_EQ(shown("postgresql://host/fleet?user=me&%70assword=secret&sslpassword=secret"),
            "postgresql://me@host/fleet");
  EXPECT_EQ(shown("postgresql://%2Ftmp%2Fx/fleet"), "postgresql:///fleet?host=/tmp/x");
  EXPECT_EQ(shown("postgresql:///fl%1Beet"), "postgresql:///fl\\x1beet") << "nothing controls a terminal";
}

TEST(PostgresAddress, OfAnotherFormIsRefusedWithoutItsPassword) {
  for (const char* uri : {"postgresql://me:secret@secret@host/fleet", "postgresql://me:secret/secret@host/fleet",
                          "postgresql://me:secret%zz@host/fleet", "postgresql://me:secret@host/fleet?secret",
                          "postgresql://me:secret@[::1", "postgresql://host/fleet?secret=secret",
                          "postgresql://me:sec: \"secret%zz@host/fleet", "postgresql://me:secret?secret@@host",
                          "postgresql://me:secret/fleet"}) {
    const auto address = PostgresAddress::parse(uri);
    ASSERT_FALSE(address.ok()) << uri;
    EXPECT_EQ(address.error().code, ErrorCode::Invalid);
    EXPECT_THAT(address.error().message, HasSubstr("postgresql://USER@HOST:PORT/DATABASE"));
    EXPECT_THAT(address.error().message, ::testing::Not(HasSubstr("secret"))) << uri;
  }
}

TEST_F(Fleet, CatalogueKnowsADriveByItsPlan) {
  add_drive("one", "no recording");
  const FleetPlan made = plan();
  const std::string key = entry_of(made, made.tasks[0]).key;
  EXPECT_EQ(key, made.results() / made.tasks[0].name);
  ASSERT_TRUE(do_first(made, copier()).ok());
  EXPECT_EQ(entry_of(made, made.tasks[0]).key, key) << "whether it is done or not";
  EXPECT_EQ(entry_of(folder_ / "one").key, folder_ / "one" / "drive.mcap");
}

TEST_F(Fleet, CatalogueHasDrivesThatAreNotDoneAndWhy) {
  add_drive("one", "no recording");
  const FleetPlan made = plan();
  const CatalogueEntry open = entry_of(made, made.tasks[0]);
  EXPECT_EQ(open.status, "open");
  EXPECT_THAT(open.text, HasSubstr("drive.mcap"));
  ASSERT_TRUE(do_first(made, copier()).ok());
  const CatalogueEntry done = entry_of(made, made.tasks[0]);
  EXPECT_EQ(done.status, "done");
  EXPECT_EQ(done.verdict, "good");
  EXPECT_EQ(done.products.size(), 2U);
  EXPECT_TRUE(geopackage_of({open, done}).ok());
}

TEST_F(Fleet, PlanNamesDrivesByTheEndsOfTheirPaths) {
  add_drive("van1/monday", "a");
  add_drive("van2/monday", "b");
  add_drive("van2/tuesday", "c");
  write_file(folder_ / "cut.mcap", "d");
  wish_.drives.push_back((folder_ / "cut.mcap").string());
  const FleetPlan made = plan();
  std::vector<std::string> names;
  for (const FleetTask& task : made.tasks) names.push_back(task.name);
  EXPECT_THAT(names, ::testing::ElementsAre("van1_monday", "van2_monday", "tuesday", "cut"));
  EXPECT_EQ(made.tasks[2].inputs[0].sha256, *sha256_of(folder_ / "van2/tuesday/drive.mcap"));
  EXPECT_EQ(made.results(), folder_ / "plan");
}

TEST_F(Fleet, PlanHasEverySegmentAndTheFilesOfEachDrive) {
  add_drive("one", "a");
  add_drive("two", "b");
  write_file(folder_ / "one/drive.000002.mcap", "more");
  for (const char* file : {"rig.yaml", "one.out", "two.out", "one.sigma", "two.sigma"})
    write_file(folder_ / file, file);
  wish_.rig = folder_ / "rig.yaml";
  wish_.trajectory = folder_ / "{drive}.out";
  wish_.trajectory_sigma = folder_ / "{drive}.sigma";
  wish_.trajectory_time = "utc";
  wish_.trajectory_point = "-1,0,0.5";
  const FleetPlan made = plan();
  const FleetTask& one = made.tasks[0];
  ASSERT_EQ(one.inputs.size(), 5U);
  EXPECT_EQ(one.inputs[1].file, folder_ / "one/drive.000002.mcap");
  EXPECT_EQ(one.recording(), folder_ / "one/drive.mcap");
  EXPECT_THAT(made.tasks[1].options(), ::testing::ElementsAre("--rig=" + (folder_ / "rig.yaml").string(),
                                                              "--trajectory=" + (folder_ / "two.out").string(),
                                                              "--trajectory-sigma=" + (folder_ / "two.sigma").string(),
                                                              "--trajectory-time=utc", "--trajectory-point=-1,0,0.5"));
  // What is written is what is read.
  write_file(made.file, made.json().dump());
  const auto read = read_plan(made.file);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->json(), made.json());
  EXPECT_EQ(question_of(*read, read->tasks[0]), question_of(made, made.tasks[0]));
  EXPECT_NE(question_of(made, made.tasks[0]), question_of(made, made.tasks[1]));
}

TEST_F(Fleet, PlanTellsEveryInputThatCannotBeRead) {
  add_drive("good", "a");
  wish_.drives.insert(wish_.drives.begin(), (folder_ / "none1").string());
  wish_.drives.push_back((folder_ / "none2").string());
  const auto made = make_plan(wish_, folder_ / "plan.json");
  ASSERT_FALSE(made.ok());
  EXPECT_THAT(made.error().message, HasSubstr("none1: open "));
  EXPECT_THAT(made.error().message, HasSubstr("none2: open "));
  EXPECT_THAT(made.error().message, ::testing::Not(HasSubstr("good")));
}

TEST_F(Fleet, PlanRefusesWhatItCannotName) {
  add_drive("one", "a");
  const auto refused = [&](const fs::path& file) { return make_plan(wish_, file).error().message; };
  EXPECT_THAT(refused(folder_ / "plan"), HasSubstr("ends with .json"));
  wish_.drives.push_back((folder_ / "one").string() + "/");
  EXPECT_THAT(refused(folder_ / "plan.json"), HasSubstr("named twice"));
  wish_.drives.pop_back();
  wish_.trajectory_sigma = "x";
  EXPECT_THAT(refused(folder_ / "plan.json"), HasSubstr("belong to --trajectory"));
  wish_.trajectory_sigma.clear();
  add_drive("new\nline", "b");
  EXPECT_THAT(refused(folder_ / "plan.json"), HasSubstr("signs that are not text"));
}

TEST_F(Fleet, PlanThatIsNoneIsRefusedWithItsPlace) {
  add_drive("one", "a");
  add_drive("two", "b");
  const nlohmann::ordered_json good = plan().json();
  const fs::path file = folder_ / "plan.json";
  const auto refused = [&](const nlohmann::ordered_json& json) {
    write_file(file, json.dump());
    const auto read = read_plan(file);
    return read.ok() ? std::string("read") : read.error().message;
  };
  EXPECT_EQ(refused(good), "read");
  const auto with = [&](const char* pointer, nlohmann::ordered_json value) {
    nlohmann::ordered_json changed = good;
    changed[nlohmann::ordered_json::json_pointer(pointer)] = std::move(value);
    return refused(changed);
  };
  EXPECT_THAT(with("/hueline_plan", 2), HasSubstr("/hueline_plan is not 1"));
  EXPECT_THAT(with("/tasks", nlohmann::ordered_json::array()), HasSubstr("/tasks is missing or not a list"));
  // Results are written beside each other, and nowhere else.
  for (const char* name : {"", ".", "..", "../one", "a/b", "/tmp/x", ".one", "one.failed"})
    EXPECT_THAT(with("/tasks/0/name", name), HasSubstr("/tasks/0 /name is not the name of a folder")) << name;
  EXPECT_THAT(with("/tasks/1/name", "one"), HasSubstr("/tasks/1 /name is that of another task"));
  EXPECT_THAT(with("/tasks/0/inputs/0/file", "drive.mcap"), HasSubstr("not an absolute path"));
  EXPECT_THAT(with("/tasks/0/inputs/0/sha256", "00"), HasSubstr("64 hexadecimal digits"));
  EXPECT_THAT(with("/tasks/0/inputs/0/role", "rig"), HasSubstr("/inputs/0 is not a recording"));
  EXPECT_THAT(with("/tasks/0/inputs/0/role", "--expect"), HasSubstr("/role is not"));
  EXPECT_THAT(with("/tasks/1/inputs/0/bytes", -1), HasSubstr("/tasks/1/inputs/0/bytes is missing or not a number"));
}

TEST_F(Fleet, DamagedPlanEndsInASentence) {
  add_drive("one", "a");
  add_drive("two", "b");
  const std::string good = plan().json().dump(1);
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random() % 256);
    if (i % 4 == 0) bytes.resize(random() % bytes.size());
    write_file(folder_ / "plan.json", bytes);
    const auto read = read_plan(folder_ / "plan.json");
    if (read.ok()) continue;
    ++refused;
    EXPECT_THAT(read.error().message, HasSubstr("plan.json"));
  }
  EXPECT_GT(refused, 250);
  write_file(folder_ / "plan.json", std::string(100'000, '['));
  EXPECT_FALSE(read_plan(folder_ / "plan.json").ok());
}

TEST_F(Fleet, TaskIsDoneOnce) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  bool is_new = false;
  const auto result = do_task(made, made.tasks[0], copier(), {}, &is_new);
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(is_new);
  EXPECT_EQ(result->end, TaskEnd::Done);
  EXPECT_EQ(result->verdict, "good");
  EXPECT_EQ(contents(made.results() / "one/cloud.las"), "cloud of bytes");
  EXPECT_EQ(result->products.at("cloud.las").sha256, *sha256_of(made.results() / "one/cloud.las"));
  EXPECT_EQ(left(made), std::set<std::string>({"one"})) << "nothing else is left";
  const auto again = do_task(made, made.tasks[0], copier(), {}, &is_new);
  EXPECT_FALSE(is_new);
  EXPECT_EQ(replays_, 1);
  EXPECT_EQ(again->json({}), result->json({}));
}

TEST_F(Fleet, PartsOfACloudAreProductsInAFolderOfTheirOwn) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  const Replayer with_parts = [this](const std::vector<std::string>& words, const fs::path& log,
                                     const std::stop_token& stop) {
    fs::create_directories(fs::path(words.at(2)) / "parts");
    write_file(fs::path(words.at(2)) / "parts/tile_0_0_100m.laz", "tile");
    return copier()(words, log, stop);
  };
  ASSERT_TRUE(do_first(made, with_parts).ok());
  const fs::path tile = made.results() / "one/parts/tile_0_0_100m.laz";
  const auto result = finished_result(made, made.tasks[0], Check::Digests);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->products.at("parts/tile_0_0_100m.laz").sha256, *sha256_of(tile));
  write_file(tile, "tilE");
  EXPECT_FALSE(finished_result(made, made.tasks[0], Check::Digests));
  // A name that leads out of the folder is no product.
  ASSERT_TRUE(do_first(made, with_parts).ok());
  const fs::path json = made.results() / "one/result.json";
  std::string text = contents(json);
  const std::string name = "parts/tile_0_0_100m.laz";
  ASSERT_NE(text.find(name), std::string::npos);
  write_file(made.results() / "tile_0_0_100m.laz", "tile");
  write_file(json, text.replace(text.find(name), name.size(), "../tile_0_0_100m.laz"));
  EXPECT_FALSE(finished_result(made, made.tasks[0], Check::Digests));
}

TEST_F(Fleet, TaskIsDoneAgainIfItsResultsAreNotWhatWasWritten) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  const fs::path cloud = made.results() / "one/cloud.las";
  ASSERT_TRUE(do_first(made, copier()).ok());
  write_file(cloud, "cloud of byteS");
  EXPECT_TRUE(finished_result(made, made.tasks[0], Check::Sizes)) << "a quick look does not read the files";
  EXPECT_EQ(do_first(made, copier())->end, TaskEnd::Done);
  EXPECT_EQ(contents(cloud), "cloud of bytes");
  write_file(cloud, "");
  EXPECT_FALSE(finished_result(made, made.tasks[0], Check::Sizes));
  fs::remove(cloud);
  EXPECT_EQ(do_first(made, copier())->end, TaskEnd::Done);
  write_file(made.results() / "one/result.json", "{}");
  EXPECT_EQ(do_first(made, copier())->end, TaskEnd::Done);
  EXPECT_EQ(replays_, 4);
  EXPECT_EQ(left(made), std::set<std::string>({"one"}));
  // An engine may have made the folder before.
  fs::remove_all(made.results() / "one");
  fs::create_directory(made.results() / "one");
  EXPECT_EQ(do_first(made, copier())->end, TaskEnd::Done);
  // Another question has another answer.
  write_file(folder_ / "one/drive.mcap", "other");
  EXPECT_EQ(do_first(plan(), copier())->end, TaskEnd::Done);
  EXPECT_EQ(contents(cloud), "cloud of other");
}

TEST_F(Fleet, InputThatChangedIsNamedAndNotReplayed) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  write_file(folder_ / "one/drive.mcap", "bytEs");
  const auto result = do_first(made, copier());
  EXPECT_EQ(result->end, TaskEnd::InputChanged);
  EXPECT_THAT(result->text, HasSubstr("one/drive.mcap: its SHA-256 is "));
  EXPECT_EQ(replays_, 0);
  EXPECT_EQ(left(made), std::set<std::string>({"one.failed"}));
  EXPECT_EQ(failed_result(made, made.tasks[0])->end, TaskEnd::InputChanged);
  fs::remove(folder_ / "one/drive.mcap");
  EXPECT_EQ(do_first(made, copier())->end, TaskEnd::InputMissing);
  write_file(folder_ / "one/drive.mcap", "bytes");
  EXPECT_EQ(do_first(made, copier())->end, TaskEnd::Done);
  EXPECT_EQ(left(made), std::set<std::string>({"one"})) << "what had failed is not told any more";
}

TEST_F(Fleet, EveryEndOfAReplayHasItsCause) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  struct Case {
    int status;
    TaskEnd end;
    int exit;
  };
  for (const Case& one : {Case{kDriveAgain, TaskEnd::Done, kDone}, Case{kInputUnreadable, TaskEnd::Damaged, 3},
                          Case{kNothingCame, TaskEnd::Empty, 5}}) {
    fs::remove_all(made.results());
    const auto result = do_first(made, copier(one.status));
    EXPECT_EQ(result->end, one.end);
    EXPECT_EQ(exit_status(result->end), one.exit);
    EXPECT_EQ(left(made), std::set<std::string>({"one"}));
    EXPECT_EQ(do_first(made, copier())->end, one.end) << "it would end in the same way again";
  }
  for (const Case& one : {Case{kFailed, TaskEnd::Failed, 1}, Case{kWrongUse, TaskEnd::Refused, 2},
                          Case{kOutputRefused, TaskEnd::OutputRefused, 4}, Case{128 + 9, TaskEnd::Crashed, 1},
                          Case{128 + 11, TaskEnd::Crashed, 1}}) {
    fs::remove_all(made.results());
    const auto result = do_first(made, copier(one.status));
    EXPECT_EQ(result->end, one.end);
    EXPECT_EQ(exit_status(result->end), one.exit);
    EXPECT_THAT(result->text, HasSubstr("something was wrong"));
    EXPECT_EQ(left(made), std::set<std::string>({"one.failed"}));
    EXPECT_TRUE(fs::exists(failure_of(made, made.tasks[0]) / "log.txt"));
    EXPECT_FALSE(fs::exists(failure_of(made, made.tasks[0]) / "cloud.las")) << "nothing that looks finished";
  }
  const Replayer silent = [](const auto&, const auto&, const auto&) { return Result<int>(kDone); };
  EXPECT_EQ(do_first(made, silent)->end, TaskEnd::Failed) << "a replay that claims to be done and wrote nothing";
  const Replayer blind = [](const auto&, const auto&, const auto&) { return Result<int>(kInputUnreadable); };
  EXPECT_EQ(do_first(made, blind)->end, TaskEnd::InputMissing);
  const Replayer cut_off = [](const std::vector<std::string>& words, const auto&, const auto&) {
    const fs::path out = words.at(2);
    write_file(out / "cloud.las", "half of it");
    write_file(out / "summary.json", R"({"ends_early": "the network went away"})");
    return Result<int>(kInputUnreadable);
  };
  fs::remove_all(made.results());
  EXPECT_EQ(do_first(made, cut_off)->end, TaskEnd::InputMissing);
  EXPECT_EQ(left(made), std::set<std::string>({"one.failed"})) << "half a drive is no result";
  const Replayer absent = [](const auto&, const auto&, const auto&) {
    return Result<int>(Error{ErrorCode::Io, "hueline cannot be started"});
  };
  EXPECT_THAT(do_first(made, absent)->text, HasSubstr("cannot be started"));
}

TEST_F(Fleet, AnotherProgramDoesNotDoThePlan) {
  add_drive("one", "bytes");
  FleetPlan made = plan();
  made.git_revision = "0000000";
  const auto result = do_first(made, copier());
  EXPECT_EQ(result->end, TaskEnd::OtherProgram);
  EXPECT_THAT(result->text, HasSubstr("0000000"));
  EXPECT_EQ(replays_, 0);
}

TEST_F(Fleet, StoppedTaskIsOpenAgain) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  std::stop_source stop;
  const Replayer stopped = [&](const auto&, const auto&, const auto&) {
    stop.request_stop();
    return Result<int>(128 + 15);
  };
  EXPECT_EQ(do_task(made, made.tasks[0], stopped, stop.get_token())->end, TaskEnd::Stopped);
  EXPECT_TRUE(left(made).empty());
  EXPECT_EQ(FleetState::read(made).exit_status(), kStopped);
}

TEST_F(Fleet, WhatAKilledAttemptLeftIsRemoved) {
  add_drive("one", "bytes");
  add_drive("two", "bytes");
  const FleetPlan made = plan();
  fs::create_directories(made.results() / ".one.attempt.host.1.1/drive");
  write_file(made.results() / ".one.attempt.host.1.1/drive/cloud.las", "half");
  fs::create_directories(made.results() / ".two.attempt.host.1.1/drive");
  const auto held = OutputFolder::open(made.results() / ".two.attempt.host.1.1");
  ASSERT_TRUE(held.ok());
  for (const FleetTask& task : made.tasks) EXPECT_EQ(do_task(made, task, copier(), {})->end, TaskEnd::Done);
  EXPECT_EQ(left(made), std::set<std::string>({"one", "two", ".two.attempt.host.1.1"})) << "not that of a live one";
}

TEST_F(Fleet, WhatAKilledAttemptLeftIsRemovedFromADoneTaskToo) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  ASSERT_TRUE(do_first(made, copier()).ok());
  fs::create_directories(made.results() / ".one.attempt.host.1.1/drive");
  ASSERT_TRUE(do_first(made, copier()).ok());
  EXPECT_EQ(left(made), std::set<std::string>({"one"}));
}

TEST_F(Fleet, SameTaskAtTheSameTimeGivesOneResult) {
  add_drive("one", "bytes");
  const FleetPlan made = plan();
  for (int round = 0; round < 20; ++round) {
    fs::remove_all(made.results());
    fs::create_directory(made.results());
    std::vector<std::jthread> programs;
    std::array<TaskEnd, 4> ends{};
    for (TaskEnd& end : ends)
      programs.emplace_back([&] {
        const auto result = do_first(made, copier());
        end = result.ok() ? result->end : TaskEnd::Failed;
      });
    programs.clear();
    EXPECT_THAT(ends, ::testing::Each(TaskEnd::Done));
    EXPECT_TRUE(finished_result(made, made.tasks[0], Check::Digests));
    EXPECT_EQ(left(made), std::set<std::string>({"one"}));
  }
}

TEST_F(Fleet, RunGoesOnAfterAFailureAndTellsTheState) {
  for (const char* name : {"a", "b", "c", "d"}) add_drive(name, name);
  const FleetPlan made = plan();
  EXPECT_EQ(FleetState::read(made).exit_status(), kStopped);
  write_file(folder_ / "b/drive.mcap", "changed");
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(run_fleet(made, 3, copier(), {}), kInputUnreadable);
  const std::string said = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(said, HasSubstr("3 of 4 drives done; 3 good\n"));
  EXPECT_THAT(said, HasSubstr("1 failed, an input is not what it was when the plan was made: b\n"));
  EXPECT_EQ(FleetState::read(made).to_do(), std::vector<std::size_t>({2}));
  write_file(folder_ / "b/drive.mcap", "b");
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(run_fleet(made, 1, copier(), {}), kDone);
  EXPECT_THAT(::testing::internal::GetCapturedStdout(), HasSubstr("4 of 4 drives done; 4 good\n"));
  EXPECT_EQ(replays_, 4);
}

TEST_F(Fleet, ScriptForSlurmHasTheTasksAndTheWords) {
  add_drive("one", "a");
  FleetPlan made = plan();
  made.file = folder_ / "it's $(touch x).json";
  SubmitWish wish{"day", "2:00:00", "8G", 4, 2, {}};
  const auto script = slurm_script(made, {3, 5, 8}, wish, "/opt/hueline");
  ASSERT_TRUE(script.ok());
  for (const char* line : {"\n#SBATCH --array=0-2%2\n", "\n#SBATCH --partition=day\n", "\n#SBATCH --time=2:00:00\n",
                           "\n#SBATCH --mem=8G\n", "\n#SBATCH --cpus-per-task=4\n", "\n#SBATCH --requeue\n",
                           "\n#SBATCH --job-name=hueline-it_s___touch_x_\n"})
    EXPECT_THAT(*script, HasSubstr(line));
  // What the shell makes of it: the program is echo, which prints the words that it gets.
  const auto echoed = slurm_script(made, {3, 5, 8}, wish, "/bin/echo");
  write_file(folder_ / "array.sh", *echoed);
  const std::string command = "cd " + folder_.path().string() + " && SLURM_ARRAY_TASK_ID=1 bash array.sh >said.txt";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(contents(folder_ / "said.txt"), "fleet task " + made.file.string() + " 5 --threads=4\n");
  EXPECT_FALSE(fs::exists(folder_ / "x"));
  wish.time = "1\nrm";
  EXPECT_THAT(slurm_script(made, {1}, wish, "/opt/hueline").error().message, HasSubstr("--time '1"));
  wish.time.clear();
  made.file = folder_ / "100%.json";
  EXPECT_THAT(slurm_script(made, {1}, wish, "/opt/hueline").error().message, HasSubstr("rename it"));
}

TEST_F(Fleet, SnakefileQuotesItsTexts) {
  add_drive("one", "a");
  FleetPlan made = plan();
  made.file = folder_ / "say \"x\".json";
  const std::string text = snakefile(made, {1, 4}, {}, "/opt/hueline");
  EXPECT_THAT(text, HasSubstr("expand(\"{number}.done\", number=[1, 4])"));
  EXPECT_THAT(text, HasSubstr("/say \\\"x\\\".json\"\n"));
  EXPECT_THAT(text, HasSubstr("{params.hueline:q} fleet task {params.plan:q} {wildcards.number} --threads={threads}"));
}

/// A drive of two places with a verdict.
CatalogueEntry driven(const std::string& name, double latitude_deg, double longitude_deg) {
  CatalogueEntry out;
  out.name = name;
  out.status = "done";
  out.verdict = "good";
  out.begin = out.end = "2026-11-28T12:00:00.000Z";
  out.duration_s = 3600;
  out.path_m = 10'000;
  out.recording_bytes = 5'000'000'000;
  out.rig = "van";
  out.places = {{latitude_deg / kDegPerRad, longitude_deg / kDegPerRad, 0},
                {latitude_deg / kDegPerRad, (longitude_deg + 0.01) / kDegPerRad, 0}};
  return out;
}

TEST(CoverageMap, HasTheDrivesOfAnAreaTogether) {
  std::vector<CatalogueEntry> drives{driven("munich", 48.1, 11.5),      driven("fiji west", -17, 179.995),
                                     driven("nowhere", 0, 0),           driven("munich again", 48.12, 11.6),
                                     driven("fiji east", -17, -179.95), driven("augsburg", 48.37, 10.89)};
  drives[2].places.clear();
  drives[4].path_m = 30'000;
  const auto areas = coverage_areas(drives);
  ASSERT_EQ(areas.size(), 3u);
  EXPECT_EQ(areas[0].drives, (std::vector<std::size_t>{1, 4})) << "the date line parts no drives";
  EXPECT_DOUBLE_EQ(areas[0].path_m, 40'000);
  EXPECT_NEAR(std::abs(areas[0].longitude_deg), 179.97, 0.02);
  EXPECT_EQ(areas[1].drives, (std::vector<std::size_t>{0, 3}));
  EXPECT_NEAR(areas[1].latitude_deg, 48.11, 1e-9);
  EXPECT_EQ(areas[2].drives, std::vector<std::size_t>{5});
  // 0.055 deg of longitude are 5.85 km there; the line of the first drive is 1.06 km long.
  const std::string map = coverage_map(areas[0], drives);
  double from = 0, to = 0, y = 0;
  ASSERT_EQ(std::sscanf(map.c_str() + map.find("points=\""), "points=\"%lf,%lf %lf", &from, &y, &to), 3) << map;
  EXPECT_NEAR((to - from) / (760 - 48), 0.01 / 0.065, 0.001);
}

TEST(CataloguePage, ShowsWhatIsWrongAndWhatItCost) {
  std::vector<CatalogueEntry> drives{driven("one", 48.1, 11.5), driven("<b>two</b>", 48.1, 11.5), driven("none", 0, 0)};
  drives[0].fusion_s = 1800;
  drives[0].watch = CatalogueWatch{{0.02, -0.01, 0.03}, 0.004, 0.5, 0.1};
  drives[0].troubles = {{"pos", "weak_gnss", "no fixed solution", 12}, {"pos", "weak_gnss", "again", 5}};
  drives[1].troubles = {{"pos", "weak_gnss", "no fixed solution", 20}};
  drives[1].verdict = "drive again";
  drives[1].reasons = {"pos: lost 3 %", "camera: gone", "laser: gone"};
  drives[2] = {};
  drives[2].name = "none";
  drives[2].status = "input_missing";
  drives[2].text = "no such file";
  const std::string page = catalogue_page(drives, "/somewhere");
  EXPECT_EQ(page.find("<b>two"), std::string::npos);
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;two&lt;/b&gt;"));
  EXPECT_THAT(page, HasSubstr("pos: lost 3 %; and 2 more"));
  EXPECT_THAT(page, HasSubstr("<td>pos</td><td>weak_gnss</td><td class=\"n\">2</td><td class=\"n\">37</td>"));
  EXPECT_THAT(page, HasSubstr("<td>input_missing</td><td class=\"n\">1</td><td class=\"w\">none</td>"));
  // 10 GB in 20 km and 2 h; half an hour of fusion for one of them.
  EXPECT_THAT(page,
              HasSubstr("<td class=\"n\">10.00 GB</td><td class=\"n\">0.500 GB</td><td class=\"n\">5.00 GB</td>"));
  EXPECT_THAT(page, HasSubstr("<td class=\"n\">0.50 h</td><td class=\"n\">0.050 h</td><td class=\"n\">0.50 h</td>"));
  EXPECT_THAT(page, HasSubstr("Head turned against the rig"));
  EXPECT_THAT(page, HasSubstr("days after 2026-11-28"));
}

}  // namespace
}  // namespace hueline::apps
