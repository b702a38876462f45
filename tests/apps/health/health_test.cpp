// Mistakes made on purpose in a simulated drive: health finds each within five seconds, and names the cause.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "drivers/pps/pps_packet.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/verdict.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"

namespace hueline::test {
namespace {

using runtime::HealthChange;
using runtime::HealthLevel;
using runtime::Trouble;
using testing::HasSubstr;

constexpr double kLeadIn = 4, kMistake = 10;  // s after the beginning; the laser and the camera send from kLeadIn on

class Health : public testing::Test {
 protected:
  struct Heard : runtime::Summary {
    using runtime::Summary::Summary;
    std::vector<HealthChange> changes;
    void on_health(const HealthChange& change) override { changes.push_back(change); }
  };
  /// Changes a packet, or says by false that it was never sent.
  using Change = std::function<bool(Packet&, double at_s)>;

  static void SetUpTestSuite() {
    scenario_ = new sim::Scenario(config::load_scenario(HUELINE_SOURCE_DIR "/tests/scenarios/short_flawless.yaml"));
    const auto drive =
        sim::generate(*scenario_, (std::filesystem::temp_directory_path() / "hueline-health-drive").string());
    ASSERT_TRUE(drive.ok());
    drive_ = new sim::Drive(*drive);
  }
  static std::string rig_text() { return apps::simulated_rig(*scenario_, {}, "lens"); }

  /// Drives with these faults, and with packets as `change` makes them.
  void drive(const std::vector<sim::FaultLine>& faults, const Change& change = {},
             const std::string& rig_of = rig_text()) {
    const config::Rig rig = config::parse_rig(rig_of, "rig");
    names_ = rig.sensor_names();
    sim::TimelineConfig config;
    config.laser_model = scenario_->laser.model;
    const auto timeline = sim::build_faulty_timeline(*drive_, config, faults);
    ASSERT_TRUE(timeline.ok());
    Heard heard(names_);
    runtime::Pipeline pipeline(rig, 1, heard);
    std::uint64_t sequence = 0;
    ASSERT_TRUE(apps::for_each_simulated_packet(*drive_, timeline->timeline, rig, [&](const Packet& packet) {
                  Packet changed = packet;
                  const double at_s = to_seconds(packet.received - apps::kSimulatedHostBegin);
                  if (change && !change(changed, at_s)) return true;
                  changed.sequence = sequence++;
                  if (!(changed.shed && hides_shed_)) pipeline.process(changed);
                  return true;
                }).ok());
    pipeline.flush();
    episodes_ = pipeline.health().episodes();
    pipeline.report(heard);
    verdict_ = runtime::judge_drive(rig, pipeline.health(), heard);
    changes_ = std::move(heard.changes);
  }

  /// Returns the first change for the worse of a trouble of this sensor since then, or null.
  const HealthChange* find(const char* sensor, Trouble trouble, double begin_s = 0) const {
    for (const HealthChange& change : changes_)
      if (change.drive_s >= begin_s && names_.at(change.sensor) == sensor && change.trouble == trouble &&
          change.level != HealthLevel::Ok)
        return &change;
    return nullptr;
  }
  /// Expects that a trouble was told between `begin_s` and five seconds later.
  void expect(const char* sensor, Trouble trouble, HealthLevel level, double begin_s, const char* cause) const {
    const HealthChange* found = find(sensor, trouble, begin_s);
    ASSERT_NE(found, nullptr) << runtime::name(trouble) << " of " << sensor << "\n" << told();
    EXPECT_GE(found->level, level) << told();
    EXPECT_LE(found->drive_s, begin_s + 5) << told();
    EXPECT_THAT(found->cause, HasSubstr(cause));
    EXPECT_FALSE(found->action.empty());
  }
  std::string told() const {
    std::string out;
    for (const HealthChange& change : changes_)
      out += std::to_string(change.drive_s) + " s " + names_.at(change.sensor) + ": " + text(change) + "\n";
    return out;
  }
  SensorId id(const std::string& sensor) const {
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (names_[i] == sensor) return static_cast<SensorId>(i);
    return kSystemSensor;
  }

  static sim::Scenario* scenario_;
  static sim::Drive* drive_;
  bool hides_shed_ = false;  // as in a capture, whose pipeline does not get them
  std::vector<HealthChange> changes_;
  runtime::Verdict verdict_;
  std::vector<std::string> names_{"hueline", "pps", "pos", "laser", "camera"};
  std::vector<runtime::HealthEpisode> episodes_;
};
sim::Scenario* Health::scenario_ = nullptr;
sim::Drive* Health::drive_ = nullptr;

sim::FaultLine line(sim::FaultType type, double at_s, double for_s) { return sim::FaultLine::usual(type, at_s, for_s); }

TEST_F(Health, AFlawlessDriveIsGoodAndGivesNoWarning) {
  drive({});
  for (const HealthChange& change : changes_) EXPECT_LT(change.level, HealthLevel::Warning) << text(change);
  ASSERT_FALSE(changes_.empty());
  EXPECT_THAT(told(), HasSubstr("all is well"));
  EXPECT_EQ(verdict_.grade, runtime::Grade::Good) << verdict_.text();
}

TEST_F(Health, TheLasersDataPortIsWrong) {
  // What comes then are the position packets, on the other port.
  drive({}, [&](Packet& packet, double) { return packet.sensor != id("laser") || packet.bytes.size() < 1000; });
  expect("laser", Trouble::NoData, HealthLevel::Waiting, 0, "no returns");
}

TEST_F(Health, TheLasersDataEndWhileItsPositionsCome) {
  drive({}, [&](Packet& packet, double at_s) {
    return at_s < kMistake || packet.sensor != id("laser") || packet.bytes.size() < 1000;
  });
  expect("laser", Trouble::NoData, HealthLevel::Alarm, kMistake, "no returns");
}

TEST_F(Health, TheStrobeIsOnAnotherInput) {
  std::string rig = rig_text();
  const auto at = rig.find("event_input: 1");
  ASSERT_NE(at, std::string::npos);
  drive({}, {}, rig.replace(at, 14, "event_input: 2"));
  expect("camera", Trouble::NoMarks, HealthLevel::Alarm, kLeadIn, "come at input 1, not at 2");
  EXPECT_EQ(verdict_.grade, runtime::Grade::Again) << verdict_.text();
  EXPECT_THAT(verdict_.text(), HasSubstr("0.0 % of the points are coloured (wanted: 80.0 %"));
}

TEST_F(Health, WithoutAStrobeItIsSaidWhatTheCamerasTimesNeed) {
  std::string rig = rig_text();
  drive({}, {}, rig.replace(rig.find("event_input: 1"), 14, "event_input: 0"));
  expect("camera", Trouble::TimeSigma, HealthLevel::Warning, kLeadIn, "its times have a sigma of");
  EXPECT_THAT(find("camera", Trouble::TimeSigma)->action, HasSubstr("event_input: 0"));
}

TEST_F(Health, AClockThatDoesNotLockIsNoFaultOfCameraAndLaser) {
  drive({}, [&](Packet& packet, double) {
    if (packet.sensor != id("pps")) return true;
    const auto edge = drivers::decode_pps(packet.bytes.bytes());
    if (!edge) return true;
    const auto scattered = edge->time + std::chrono::milliseconds(edge->sequence * 7 % 11);
    packet.bytes = Buffer::copy_of(drivers::encode_pps({edge->edge, edge->sequence, scattered}));
    packet.received = scattered;
    return true;
  });
  expect("pps", Trouble::NoClock, HealthLevel::Waiting, 0, "the clock is not locked: ");
  for (std::size_t i = 0; i < runtime::kTroubles; ++i)
    for (const char* sensor : {"camera", "laser"})
      EXPECT_EQ(find(sensor, static_cast<Trouble>(i), kLeadIn + 1), nullptr) << told();
}

TEST_F(Health, TheCamerasConnectionIsLost) {
  bool is_gone = false;
  drive({}, [&](Packet& packet, double at_s) {
    if (packet.sensor != id("camera") || at_s < kMistake) return true;
    if (is_gone) return false;
    is_gone = true;
    const Fault fault{packet.sensor, FaultKind::Disconnected, packet.received, 1,
                      "interface: this computer has no address 10.0.0.1"};
    packet.kind = PacketKind::Fault;
    packet.bytes = Buffer::copy_of(encode_fault(fault));
    return true;
  });
  expect("camera", Trouble::Gone, HealthLevel::Alarm, kMistake, "has no address 10.0.0.1");
}

TEST_F(Health, ACameraThatWasNeverThereIsNamedAtOnce) {
  bool is_gone = false;
  drive({}, [&](Packet& packet, double) {
    if (packet.sensor != id("camera")) {
      if (is_gone) return true;
      is_gone = true;
      const Fault fault{id("camera"), FaultKind::Disconnected, packet.received, 1, "no such interface"};
      packet = {id("camera"),    PacketKind::Fault, false,
                packet.sequence, packet.received,   Buffer::copy_of(encode_fault(fault))};
      return true;
    }
    return false;
  });
  expect("camera", Trouble::Missing, HealthLevel::Waiting, 0, "no such interface");
}

TEST_F(Health, ThePpsIsInvertedFromTheBeginning) {
  drive({line(sim::FaultType::PpsInverted, 0, 60)});
  expect("pps", Trouble::LatePulses, HealthLevel::Waiting, 0, "before their own time");
  EXPECT_THAT(find("pps", Trouble::LatePulses)->action, HasSubstr("inverted"));
}

TEST_F(Health, ThePpsIsInvertedWhileDriving) {
  drive({line(sim::FaultType::PpsInverted, kMistake, 60)});
  expect("pps", Trouble::Holdover, HealthLevel::Warning, kMistake, "none at its second");
}

TEST_F(Health, MessagesThatAreAlwaysLateByNearlyASecondBelongToLatePulses) {
  drive({}, [&](Packet& packet, double at_s) {
    if (packet.sensor == id("pos") && at_s > kMistake) packet.received += std::chrono::milliseconds(980);
    return true;
  });
  expect("pps", Trouble::LatePulses, HealthLevel::Alarm, kMistake, "the pulses are");
}

TEST_F(Health, MessagesThatABusyComputerGetsLateDoNotBelongToLatePulses) {
  drive({}, [&](Packet& packet, double at_s) {
    if (packet.sensor == id("pos") && at_s > kMistake)
      packet.received += std::chrono::milliseconds(std::lround(1000 + 200 * std::sin(2 * at_s)));
    return true;
  });
  EXPECT_EQ(find("pps", Trouble::LatePulses), nullptr) << told();
}

TEST_F(Health, ThePosOnlyAligns) {
  drive({line(sim::FaultType::PosNotGood, 0, 60)});
  expect("pos", Trouble::NoPose, HealthLevel::Waiting, 0, "no good solution");
}

TEST_F(Health, ARigWithAGuessIsNoGoodDrive) {
  drive({}, {}, rig_text() + "not_known: [\"the lens of lens0: nobody has measured it\"]\n");
  EXPECT_EQ(verdict_.grade, runtime::Grade::Remarks);
  EXPECT_THAT(verdict_.text(), HasSubstr("not known: the lens of lens0: nobody has measured it"));
}

TEST_F(Health, ThePosLosesItsSolution) {
  drive({line(sim::FaultType::PosNotGood, kMistake, 60)});
  expect("pos", Trouble::NoPose, HealthLevel::Alarm, kMistake, "no good solution");
}

TEST_F(Health, TheLaserFallsSilent) {
  drive({}, [&](Packet& packet, double at_s) { return at_s < kMistake || packet.sensor != id("laser"); });
  expect("laser", Trouble::Silent, HealthLevel::Alarm, kMistake, "sends nothing");
  ASSERT_EQ(episodes_.size(), 4u) << told();  // three were of the beginning
  EXPECT_NEAR(episodes_.back().begin_s, kMistake, 0.6);
  EXPECT_TRUE(episodes_.back().lasts);
  EXPECT_TRUE(episodes_.back().place);
  EXPECT_EQ(verdict_.grade, runtime::Grade::Good) << "the laser ended with the drive\n" << verdict_.text();
}

TEST_F(Health, ThePosOnlyAlignsAndNothingIsPlaced) {
  drive({line(sim::FaultType::PosNotGood, 0, 60)});
  EXPECT_EQ(verdict_.grade, runtime::Grade::Again) << verdict_.text();
  EXPECT_THAT(verdict_.text(), HasSubstr("no point was placed"));
}

TEST_F(Health, ALaserThatIsAwayForAWhileIsARemarkOrAReasonToDriveAgain) {
  const auto away = [&](double seconds) {
    drive({}, [&, seconds](Packet& packet, double at_s) {
      return packet.sensor != id("laser") || at_s < 6 || at_s > 6 + seconds;
    });
  };
  away(3.6);
  EXPECT_EQ(verdict_.grade, runtime::Grade::Remarks) << verdict_.text();
  ASSERT_EQ(verdict_.remarks.size(), 1u);
  EXPECT_TRUE(verdict_.remarks[0].place);
  EXPECT_THAT(verdict_.text(), HasSubstr("where: "));
  away(7);
  EXPECT_EQ(verdict_.grade, runtime::Grade::Again) << verdict_.text();
  EXPECT_GT(verdict_.alarm_share, 0.1);
}

TEST_F(Health, TheDiskIsNearlyFull) {
  double last = 0;
  drive({}, [&](Packet& packet, double at_s) {
    // One of the scanner's packets of a second becomes the tick of that second.
    if (packet.sensor != id("laser") || at_s < last + 1) return true;
    last = at_s;
    packet.sensor = kSystemSensor;
    packet.kind = PacketKind::Tick;
    packet.bytes = Buffer::copy_of(encode_tick(at_s < kMistake ? 500'000'000'000 : 70'000'000));
    return true;
  });
  expect("hueline", Trouble::Disk, HealthLevel::Alarm, kMistake, "the disk has 0.1 GB left");
}

TEST_F(Health, PacketsAreLeftOut) {
  drive({}, [&](Packet& packet, double at_s) {
    packet.shed = packet.sensor == id("laser") && at_s > kMistake && packet.sequence % 4 == 0;
    return true;
  });
  expect("hueline", Trouble::LeftOut, HealthLevel::Warning, kMistake, "left out");
}

TEST_F(Health, GivesTheSameWithAndWithoutThePacketsThatWereShed) {
  const auto shed = [&](Packet& packet, double at_s) {
    packet.shed = packet.sensor == id("laser") && at_s > kMistake && packet.sequence % 4 == 0;
    return true;
  };
  drive({}, shed);
  const std::string replay = told();
  EXPECT_NE(find("hueline", Trouble::LeftOut), nullptr);
  hides_shed_ = true;
  drive({}, shed);
  EXPECT_EQ(told(), replay);
}

}  // namespace
}  // namespace hueline::test
