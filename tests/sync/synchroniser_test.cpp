#include "sync/synchroniser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/rig_course.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;

TEST(Synchroniser, GivenAWholeRigWhenItDrivesThenEverythingIsStampedToMicroseconds) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20));
  drive.ins(50, late(4, 2));
  SimulatedLaser laser;
  laser.run(drive);
  SimulatedCamera camera;
  camera.run(drive);
  Outcome outcome(drive, rig_config());

  ASSERT_EQ(outcome.all.laser.size(), laser.truth.size());
  for (const StampedLaserBatch& b : outcome.all.laser) {
    EXPECT_LE(std::abs((b.time - laser.truth.at(b.packet_sequence)).count()), 1000);  // its own microseconds, truncated
    EXPECT_EQ(b.state, SyncState::Locked);
  }
  ASSERT_EQ(outcome.all.exposures.size(), camera.truth.size());
  for (const Exposure& e : outcome.all.exposures) {
    EXPECT_EQ(e.timing, ExposureTiming::EventMark) << e.index;
    EXPECT_EQ(e.exposure_mid, camera.truth.at(e.image.packet_sequence));
  }
  EXPECT_EQ(outcome.all.ins.size(), 2963u);  // 59.25 s at 50 Hz
  ASSERT_GE(outcome.all.state_changes.size(), 1u);
  EXPECT_EQ(outcome.all.state_changes.back().to, SyncState::Locked);
  for (const Fault& f : outcome.all.faults) ADD_FAILURE() << name(f.kind) << " " << f.detail;
}

/// Pulses, labels and solutions; scanner and camera are unchanged.
void usual(Drive& drive, Drive::When pps_lost = Drive::never, Drive::When labels_lost = Drive::never) {
  drive.pps(gaussian(3), pps_lost);
  drive.labels(
      kPos, late(30, 20), [](GpsTime) { return nanoseconds(0); }, labels_lost);
  drive.ins(50, late(4, 2));
}
void expect_true(const Outcome& outcome, const SimulatedLaser& laser, const SimulatedCamera& camera) {
  for (const StampedLaserBatch& b : outcome.all.laser)
    ASSERT_LE(std::abs((b.time - laser.truth.at(b.packet_sequence)).count()), 4 * b.sigma.count() + 1000);
  for (const Exposure& e : outcome.all.exposures)
    ASSERT_LE(std::abs((e.exposure_mid - camera.truth.at(e.image.packet_sequence)).count()), 5 * e.sigma.count());
}

TEST(Synchroniser, GivenLabelsThatComeLateWhenLockedThenWhatWasHeldIsStampedToo) {
  Drive drive(some_begin(), seconds(60));
  const GpsTime begin = drive.begin;
  drive.pps(gaussian(3));
  drive.labels(
      kPos, late(30, 20), [](GpsTime) { return nanoseconds(0); }, [=](GpsTime t) { return t < begin + seconds(15); });
  SimulatedLaser laser;
  laser.run(drive);
  SimulatedCamera camera;
  camera.mark_latency = late(2, 1);
  camera.run(drive);
  Synchroniser::Config c = rig_config();
  c.arrival_sources = {99};  // labels alone
  Outcome outcome(drive, c);
  EXPECT_EQ(outcome.all.laser.size(), laser.truth.size());
  EXPECT_EQ(outcome.all.exposures.size(), camera.truth.size());
  expect_true(outcome, laser, camera);
  EXPECT_EQ(outcome.count(FaultKind::NoTime), 0u);
}

TEST(Synchroniser, GivenAClockThatNeverLocksThenEveryMeasurementIsNamedOnce) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));  // pulses, but no source names their second
  SimulatedLaser laser;
  laser.run(drive);
  SimulatedCamera camera;
  camera.mark_lost = [](int) { return true; };  // marks would show the time
  camera.run(drive);
  std::size_t statuses = 0;
  for (const auto& item : drive.stream.sorted()) statuses += std::holds_alternative<LaserStatus>(item.second) ? 1 : 0;
  Outcome outcome(drive, rig_config());
  EXPECT_TRUE(outcome.all.laser.empty());
  EXPECT_TRUE(outcome.all.exposures.empty());
  EXPECT_EQ(outcome.count(FaultKind::NoTime), laser.truth.size() + camera.truth.size() + statuses);
  EXPECT_FALSE(outcome.sync.stream_time());
}

TEST(Synchroniser, GivenMoreImagesThanCanBeHeldThenTheyAloneHaveNoTime) {
  Drive drive(some_begin(), seconds(30));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20));
  drive.ins(50, late(4, 2));
  SimulatedLaser laser;
  laser.run(drive);
  SimulatedCamera camera;
  camera.run(drive);
  Synchroniser::Config c = rig_config();
  c.hold_images = 3;
  Outcome outcome(drive, c);
  EXPECT_EQ(outcome.all.laser.size(), laser.truth.size()) << "the returns from before the lock are all placed";
  EXPECT_LT(outcome.all.exposures.size(), camera.truth.size());
  EXPECT_EQ(outcome.all.exposures.size() + outcome.count(FaultKind::NoTime), camera.truth.size());
  for (const Fault& fault : outcome.all.faults)
    if (fault.kind == FaultKind::NoTime) {
      EXPECT_EQ(fault.sensor, kCamera);
      EXPECT_THAT(fault.detail, testing::HasSubstr("(hold_images)"));
    }
  EXPECT_GT(outcome.count(FaultKind::NoTime), 3u);
}

TEST(Synchroniser, GivenAFloodWithoutAClockThenWhatIsHeldIsBoundedAndTheRestIsNamed) {
  Synchroniser::Config c = rig_config();
  c.hold_bytes = 1'000'000;
  Synchroniser sync(c);
  SyncOutput out;
  constexpr std::size_t kBatches = 1000, kReturns = 384;
  for (std::size_t i = 0; i < kBatches; ++i) {
    LaserBatch batch;
    batch.sensor = kLaser;
    batch.received = host_time_ns(1'000'000'000 + static_cast<std::int64_t>(i) * 1000);
    batch.returns.reserve(2 * kReturns);
    batch.returns.resize(kReturns);
    sync.process(std::move(batch), out);
  }
  const std::uint64_t held = kBatches - sync.counts().never_stamped;
  EXPECT_LE(held * kReturns * sizeof(LaserReturn), c.hold_bytes);
  EXPECT_GE(held * kReturns * sizeof(LaserReturn), c.hold_bytes * 9 / 10) << "and the room is used";
  sync.flush(out);
  std::uint64_t untimed = 0;
  for (const auto& [reason, returns] : sync.counts().untimed) untimed += returns;
  EXPECT_EQ(untimed, kBatches * kReturns);
  std::uint64_t told = 0;
  for (const Fault& fault : out.faults) told += fault.kind == FaultKind::NoTime ? fault.count : 0;
  EXPECT_EQ(told, kBatches);
  EXPECT_LE(out.faults.size(), 4u);
}

TEST(Synchroniser, GivenPpsLostForAMinuteThenStampsStayTrueAndTheStateIsTold) {
  Drive drive(some_begin(), seconds(240));
  const GpsTime gone = drive.begin + seconds(120), back = gone + seconds(60);
  usual(drive, [=](GpsTime t) { return t > gone && t < back; });
  SimulatedLaser laser;
  laser.clock = [=](GpsTime t) { return t > gone && t < back ? SyncState::Unlocked : SyncState::Locked; };
  laser.run(drive);
  SimulatedCamera camera;
  camera.run(drive);
  Outcome outcome(drive, rig_config());
  EXPECT_EQ(outcome.all.laser.size(), laser.truth.size());
  expect_true(outcome, laser, camera);
  std::vector<SyncState> told;
  for (const SyncStateChange& change : outcome.all.state_changes) told.push_back(change.to);
  EXPECT_EQ(told, (std::vector{SyncState::Locked, SyncState::Holdover, SyncState::Locked}));
  EXPECT_NEAR(to_seconds(*outcome.all.state_changes[1].time - gone), 2.5, 1.0);
}

TEST(Synchroniser, GivenTwoScannersAndTwoCamerasThenExposuresAreOneOrderedRow) {
  Drive drive(some_begin(), seconds(60));
  usual(drive);
  SimulatedLaser laser, second_laser;
  second_laser.sensor = kLaserB;
  second_laser.clock_error = [](GpsTime) { return seconds(-1); };
  laser.run(drive);
  second_laser.run(drive);
  SimulatedCamera camera, second_camera;
  second_camera.sensor = kCameraB;
  second_camera.input = 2;
  second_camera.rate_hz = 7;
  second_camera.latency = [](Random& r, GpsTime) { return ms(60 + r.exponential(10)); };
  second_camera.mark_lost = [](int i) { return i % 11 == 4; };
  camera.run(drive);
  second_camera.run(drive);
  Synchroniser::Config c = rig_config();
  c.lasers.push_back(c.lasers[0]);
  c.lasers[1].sensor = kLaserB;
  c.cameras.push_back(c.cameras[0]);
  c.cameras[1].camera = kCameraB;
  c.cameras[1].mark_input = 2;
  c.cameras[1].latency_max = ms(140);
  Outcome outcome(drive, c);
  EXPECT_EQ(outcome.all.laser.size(), laser.truth.size() + second_laser.truth.size());
  EXPECT_EQ(outcome.all.exposures.size(), camera.truth.size() + second_camera.truth.size());
  laser.truth.merge(second_laser.truth);
  camera.truth.merge(second_camera.truth);
  expect_true(outcome, laser, camera);
  EXPECT_EQ(outcome.sync.lasers()[1].correction(), seconds(1));
}

TEST(Synchroniser, GivenSolutionsThatSlipByUtcThenTheyAreNotTrusted) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20));
  const GpsTime from = drive.begin + seconds(30), to = from + seconds(2);
  drive.ins(50, late(4, 2), [=](GpsTime t) { return t > from && t < to ? seconds(-18) : seconds(0); });
  Outcome outcome(drive, rig_config());
  std::uint64_t doubted = 0;
  for (const InsSolution& s : outcome.all.ins) doubted += s.is_good ? 0 : 1;
  EXPECT_NEAR(static_cast<double>(doubted), 100, 2);
  EXPECT_GT(outcome.count(FaultKind::LabelConflict), 90u);
  EXPECT_EQ(outcome.sync.state(), SyncState::Locked);
}

TEST(Synchroniser, GivenSolutionsThatContradictTheLabelsThenTheyAreJudgedWhenTheSecondIsSettled) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kLaser, late(30, 20));  // the POS, which is trusted, names seconds by its solutions alone
  const GpsTime from = drive.begin + seconds(30), to = from + seconds(2);
  drive.ins(50, late(4, 2), [=](GpsTime t) { return t > from && t < to ? seconds(1) : seconds(0); });
  SimulatedLaser laser;
  laser.run(drive);
  Outcome outcome(drive, rig_config());
  std::size_t disputes = 0;
  for (const SyncStateChange& change : outcome.all.state_changes)
    disputes += change.from == SyncState::Locked && change.to == SyncState::Acquiring ? 1 : 0;
  ASSERT_GE(disputes, 1u) << "else this shows nothing";
  EXPECT_EQ(outcome.all.laser.size(), laser.truth.size()) << "what was held is stamped";
  ASSERT_EQ(outcome.all.ins.size(), 2963u);  // 59.25 s at 50 Hz
  for (const InsSolution& s : outcome.all.ins) {
    const bool is_wrong = s.received > drive.clock.host(from) + ms(20) && s.received < drive.clock.host(to);
    if (is_wrong) EXPECT_FALSE(s.is_good) << to_seconds(s.time - drive.begin);
    if (s.received < drive.clock.host(from) || s.received > drive.clock.host(to) + ms(50))
      EXPECT_TRUE(s.is_good) << to_seconds(s.time - drive.begin);
  }
}

TEST(Synchroniser, GivenTheUncertaintyMessageThenSolutionsCarryIt) {
  Synchroniser sync(rig_config());
  SyncOutput out;
  sync.process(InsUncertainty{kPos, some_begin(), {1, 2, 3, 4, 5, 6, 7, 8, 9}}, out);
  InsSolution solution;
  solution.sensor = kPos;
  solution.time = some_begin() + ms(20);
  sync.process(solution, out);
  solution.time += seconds(20);
  sync.process(solution, out);
  ASSERT_EQ(out.ins.size(), 2u);
  ASSERT_TRUE(out.ins[0].sigma);
  EXPECT_EQ((*out.ins[0].sigma)[8], 9);
  EXPECT_FALSE(out.ins[1].sigma) << "too old to be true";
}

TEST(Synchroniser, GivenASensorWithoutARoleThenItIsSaid) {
  Synchroniser sync(rig_config());
  SyncOutput out;
  LaserBatch batch;
  batch.sensor = 77;
  sync.process(batch, out);
  sync.flush(out);
  EXPECT_EQ(sync.counts().unknown_sensor, 1u);
  ASSERT_EQ(out.faults.size(), 1u);
  EXPECT_EQ(out.faults[0].sensor, 77);
}

TEST(Synchroniser, GivenAWeekRolloverAnHourTurnAndEveryKindOfTroubleThenNothingIsWrongWithoutSayingSo) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    // The GPS week ends 18 s before the UTC day. Both change in the middle of the drive.
    Drive drive(from_gps_week(2300, seconds(kSecondsPerWeek - 60) + ms(250)), seconds(120), {-25, 0.1, 5, 0.2, 0, 900},
                seed);
    Random dice(seed);
    std::vector<double> roll;
    for (int i = 0; i < 4000; ++i) roll.push_back(dice.uniform());
    const auto chance = [&](int i, int salt) { return roll[static_cast<std::size_t>(i * 5 + salt) % roll.size()]; };
    drive.pps([](Random& r, GpsTime) { return us(r.uniform() < 0.02 ? 900 : std::abs(r.gauss(4))); },
              [&](GpsTime t) { return count_ns(t) / 1'000'000'000 % 9 == 4; });
    for (int i = 0; i < 30; ++i) drive.edge_at(drive.clock.host(drive.begin + ms(dice.uniform(8000, 118000))), 0);
    drive.labels(kPos, [](Random& r, GpsTime) { return ms(r.uniform() < 0.3 ? 1150 : 50); });
    drive.ins(50, late(4, 4));
    SimulatedLaser laser;
    const GpsTime slip = drive.begin + seconds(70);
    laser.clock_error = [=](GpsTime t) { return t > slip ? seconds(1) : seconds(0); };
    laser.run(drive);
    SimulatedCamera camera;
    camera.mark_lost = [&](int i) { return chance(i, 1) < 0.05; };
    camera.image_lost = [&](int i) { return chance(i, 2) < 0.05; };
    camera.mark_copies = [&](int i) { return chance(i, 3) < 0.05 ? 2 : 1; };
    camera.extra_latency = [&](int i) { return chance(i, 4) < 0.05 ? ms(250) : ms(0); };
    camera.restart_at = 500;
    camera.run(drive);
    Outcome outcome(drive, rig_config(), false);
    EXPECT_EQ(outcome.all.laser.size(), laser.truth.size());
    EXPECT_EQ(outcome.all.exposures.size(), camera.truth.size());
    expect_true(outcome, laser, camera);
    EXPECT_GE(outcome.sync.state(), SyncState::Locked)
        << "or in holdover, if an edge was lost beside a bad one just now";
  }
}

TEST(Synchroniser, GivenTheSameInputThenTheSameOutput) {
  const auto once = [] {
    Drive drive(some_begin(), seconds(60), {}, 3);
    usual(drive, [](GpsTime t) { return count_ns(t) / 1'000'000'000 % 5 == 1; });
    SimulatedLaser laser;
    laser.run(drive);
    SimulatedCamera camera;
    camera.mark_lost = [](int i) { return i % 6 == 1; };
    camera.run(drive);
    return std::move(Outcome(drive, rig_config()).all);
  };
  const SyncOutput a = once(), b = once();
  ASSERT_EQ(a.laser.size(), b.laser.size());
  for (std::size_t i = 0; i < a.laser.size(); ++i) {
    ASSERT_EQ(a.laser[i].time, b.laser[i].time);
    ASSERT_EQ(a.laser[i].sigma, b.laser[i].sigma);
  }
  ASSERT_EQ(a.exposures.size(), b.exposures.size());
  for (std::size_t i = 0; i < a.exposures.size(); ++i) {
    ASSERT_EQ(a.exposures[i].exposure_mid, b.exposures[i].exposure_mid);
    ASSERT_EQ(a.exposures[i].sigma, b.exposures[i].sigma);
  }
  ASSERT_EQ(a.faults.size(), b.faults.size());
}

TEST(Synchroniser, GivenSettingsOutOfRangeThenTheSentenceNamesTheKey) {
  Synchroniser::Config c = rig_config();
  c.hold = seconds(0);
  EXPECT_THAT(c.validate(), testing::HasSubstr("hold"));
  c = rig_config();
  c.cameras[0].exposure = seconds(9);
  EXPECT_THAT(c.validate(), testing::HasSubstr("camera 4: exposure"));
  c = rig_config();
  c.lasers.push_back(c.lasers[0]);
  EXPECT_THAT(c.validate(), testing::HasSubstr("different sensors"));
}

/// Images of a file: their arrivals mean nothing, and each says its own time 3 ms late.
struct ImagesOfFile {
  Synchroniser sync;
  SyncOutput out;
  const GpsTime begin = some_begin();
  explicit ImagesOfFile(int mark_input, std::optional<nanoseconds> offset = {})
      : sync([&] {
          Synchroniser::Config c = rig_config();
          c.self_timed = true;
          c.lasers.clear();
          c.cameras[0].mark_input = mark_input;
          c.cameras[0].counter_offset = offset;
          c.cameras[0].strobe_delay = nanoseconds(0);
          return c;
        }()) {}
  static constexpr nanoseconds kLate{3'000'000};
  void drive(bool tells_time, bool has_marks) {
    for (int i = 0; i < 400; ++i) {
      const GpsTime now = begin + i * ms(10);
      InsSolution pose;
      pose.sensor = kPos;
      pose.time = now;
      pose.is_good = true;
      sync.process(pose, out);
      if (i % 25 != 10) continue;
      if (has_marks) sync.process(EventMark{kPos, {}, now, 1, true, 0}, out);
      const HostTime received = host_time_ns(1000 + i);
      if (tells_time) sync.process(TimedArrival{kCamera, received, now + kLate}, out);
      Image image;
      image.sensor = kCamera;
      image.received = received;
      image.frame_id = static_cast<std::uint64_t>(i / 25);
      image.packet_sequence = image.frame_id;
      image.time = DeviceTime<CameraCounter>((now + kLate).time_since_epoch() - seconds(1000));
      image.is_complete = true;
      sync.process(std::move(image), out);
    }
    sync.flush(out);
  }
  GpsTime truth(const Exposure& e) const {
    return begin + (10 + 25 * static_cast<int>(e.image.packet_sequence)) * ms(10);
  }
};

TEST(Synchroniser, ImagesOfFilesTakeTheMarksThatTheirOwnTimeFinds) {
  ImagesOfFile files(1);
  files.drive(true, true);
  ASSERT_EQ(files.out.exposures.size(), 16u);
  const nanoseconds half = files.out.exposures[0].exposure_mid - files.truth(files.out.exposures[0]);
  EXPECT_LE(half, ms(5));
  for (const Exposure& e : files.out.exposures) {
    EXPECT_EQ(e.timing, ExposureTiming::EventMark);
    EXPECT_EQ(e.exposure_mid - files.truth(e), half) << "the clock of the camera is 3 ms late, the marks are not";
  }
  EXPECT_TRUE(files.out.faults.empty()) << files.out.faults[0].detail;
}

TEST(Synchroniser, ImagesOfFilesWithoutMarksHaveTheirOwnTime) {
  for (const bool has_offset : {false, true}) {
    ImagesOfFile files(0, has_offset ? std::optional<nanoseconds>(seconds(1000)) : std::nullopt);
    files.drive(!has_offset, false);
    ASSERT_EQ(files.out.exposures.size(), 16u) << has_offset;
    for (const Exposure& e : files.out.exposures) {
      EXPECT_EQ(e.timing, ExposureTiming::CameraClock);
      EXPECT_EQ(e.exposure_mid - files.truth(e),
                files.out.exposures[0].exposure_mid - files.truth(files.out.exposures[0]));
      EXPECT_GE(e.exposure_mid - files.truth(e), ImagesOfFile::kLate);
    }
  }
}

TEST(Synchroniser, ImagesOfFilesWithoutATimeAreToldAndNotUsed) {
  ImagesOfFile files(1);
  files.drive(false, true);
  EXPECT_TRUE(files.out.exposures.empty());
  ASSERT_FALSE(files.out.faults.empty());
  EXPECT_EQ(files.out.faults[0].kind, FaultKind::NoTime);
  EXPECT_EQ(files.sync.counts().never_stamped, 16u);
}

}  // namespace
}  // namespace hueline::sync
