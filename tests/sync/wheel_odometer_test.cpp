// Wheel messages of a vehicle whose motion is known, through the whole stage: their times, and their distance compared
// with that of the POS.
#include "sync/wheel_odometer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sync/synchroniser.hpp"
#include "tests/sync/simulated_time.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;

constexpr SensorId kWheel = 7;

/// The vehicle stands for 5 s, then accelerates by 1 m/s^2 up to 8 m/s.
double true_speed(double s) { return std::clamp(s - 5, 0.0, 8.0); }
double true_way(double s) { return s < 5 ? 0 : s < 13 ? (s - 5) * (s - 5) / 2 : 32 + (s - 13) * 8; }

struct WheelCourse {
  WheelOdometer::Config config;
  std::function<double(double)> says = true_speed;  // speed that the encoder reports, s after the beginning
  std::function<bool(double)> is_lost = [](double) { return false; };
  bool counts = false;                         // it counts pulses too
  double adapter_ppm = 0;                      // rate error of the adapter's own counter; 0: it has none
  double latency_ms = 0.05, jitter_ms = 0.05;  // of the kernel's stamp
  bool pos_is_good = true;

  std::vector<StampedWheelSpeed> out;
  std::vector<GpsTime> truth;  // of each message that was sent
  std::vector<Fault> faults;
  std::optional<WheelOdometer> odometer;

  void run(seconds life = seconds(60)) {
    Drive drive(some_begin(), life);
    drive.pps(gaussian(3));
    drive.labels(kPos, late(30, 20));
    for (GpsTime t = drive.begin; t < drive.end; t += ms(10)) {
      InsSolution m;
      m.sensor = kPos;
      m.received = drive.clock.host(t + ms(4 + drive.random.exponential(2)));
      m.time = t;
      m.is_good = pos_is_good;
      const double s = to_seconds(t - drive.begin), v = true_speed(s) + drive.random.gauss(0.005);
      m.attitude.heading = 2.1;
      m.velocity_enu = {v * std::sin(2.1), v * std::cos(2.1), 0};
      drive.stream.add(m.received, m);
    }
    for (GpsTime t = drive.begin + ms(3); t < drive.end; t += ms(20)) {
      const double s = to_seconds(t - drive.begin);
      if (is_lost(s)) continue;
      WheelSpeed m;
      m.sensor = kWheel;
      m.received = drive.clock.host(t + ms(latency_ms + drive.random.exponential(jitter_ms)));
      m.speed = says(s);
      m.sigma = 0.05;
      if (counts) m.distance_m = true_way(s);
      if (adapter_ppm != 0)
        m.adapter_time = DeviceTime<CanAdapterCounter>(from_seconds(7 + s * (1 + adapter_ppm * 1e-6)));
      truth.push_back(t);
      drive.stream.add(m.received, m);
    }
    Synchroniser::Config c;
    c.clock.pps = kPps;
    c.clock.label.trusted = kPos;
    c.pos = kPos;
    config.sensor = kWheel;
    c.wheels = {config};
    ASSERT_EQ(c.validate(), "");
    Synchroniser sync(c);
    SyncOutput got;
    for (auto& [received, m] : drive.stream.sorted()) sync.process(m, got);
    sync.flush(got);
    out = got.wheels;
    faults = got.faults;
    odometer = sync.wheels().at(0);
  }
  std::uint64_t count(FaultKind kind) const {
    std::uint64_t n = 0;
    for (const Fault& f : faults)
      if (f.sensor == kWheel && f.kind == kind) n += f.count;
    return n;
  }
  std::string details() const {
    std::string all;
    for (const Fault& f : faults) all += std::string(name(f.kind)) + ": " + f.detail + "\n";
    return all;
  }
};

TEST(WheelOdometer, StampsNameTheEndOfTheFrame) {
  WheelCourse course;
  course.config.stamp_delay = us(100);
  course.config.stamp_sigma = us(60);
  course.run();
  ASSERT_EQ(course.out.size(), course.truth.size()) << "what came before the lock is stamped as well";
  double squares = 0;
  for (std::size_t i = 0; i < course.out.size(); ++i) {
    const double normalised = static_cast<double>((course.out[i].time - course.truth[i]).count()) /
                              static_cast<double>(course.out[i].sigma.count());
    ASSERT_LT(std::abs(normalised), 12) << i;  // an exponential's tail
    squares += normalised * normalised;
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(course.out.size())), 0.85, 0.3);
  EXPECT_THAT(course.faults, testing::IsEmpty()) << course.details();
}

TEST(WheelOdometer, AValuesAgeIsTakenOff) {
  WheelCourse course;
  course.config.age = ms(10);
  course.run(seconds(20));
  ASSERT_EQ(course.out.size(), course.truth.size());
  EXPECT_NEAR(to_seconds(course.out.back().time - course.truth.back()), -0.010, 0.0006);
}

TEST(WheelOdometer, AnAdaptersOwnCounterTakesTheJitterAway) {
  const auto spread_us = [](double ppm) {
    WheelCourse course;
    course.adapter_ppm = ppm;
    course.latency_ms = 0.1;
    course.jitter_ms = 1.5;  // polled over USB
    course.run();
    EXPECT_EQ(course.out.size(), course.truth.size());
    double sum = 0, squares = 0;
    const std::size_t from = course.out.size() / 3;
    for (std::size_t i = from; i < course.out.size(); ++i) {
      const double error_us = static_cast<double>((course.out[i].time - course.truth[i]).count()) * 1e-3;
      sum += error_us;
      squares += error_us * error_us;
    }
    const double n = static_cast<double>(course.out.size() - from);
    return std::sqrt(squares / n - sum / n * sum / n);
  };
  EXPECT_GT(spread_us(0), 1000);
  EXPECT_LT(spread_us(30), 60);
  EXPECT_LT(spread_us(-30), 60);
}

TEST(WheelOdometer, WheelsAndPosAgreeOnTheWay) {
  WheelCourse course;
  course.counts = true;
  course.run();
  const double way = true_way(59.983);
  for (const auto& w : {course.odometer->speeds(), course.odometer->pulses()}) {
    EXPECT_NEAR(w.wheels_m, way, 0.2);
    EXPECT_NEAR(w.compared_wheels_m, w.compared_pos_m, 0.3);
    EXPECT_GT(w.compared_s, 50);
    EXPECT_EQ(w.disagreeing_s, 0);
  }
  EXPECT_THAT(course.faults, testing::IsEmpty()) << course.details();
}

TEST(WheelOdometer, StuckWheelsOnAMovingVehicleAreTold) {
  WheelCourse course;
  course.says = [](double s) { return s > 30 && s < 40 ? 0.0 : true_speed(s); };
  course.run();
  EXPECT_GE(course.count(FaultKind::Implausible), 4u) << course.details();
  EXPECT_NEAR(course.odometer->speeds().disagreeing_s, 10, 2.1);
  EXPECT_THAT(course.details(), testing::HasSubstr("by its speeds the vehicle went"));
}

TEST(WheelOdometer, SpinningWheelsOnAStandingVehicleAreTold) {
  WheelCourse course;
  course.says = [](double s) { return s < 4.5 ? 3.0 : true_speed(s); };
  course.run(seconds(20));
  EXPECT_GE(course.count(FaultKind::Implausible), 1u) << course.details();
}

TEST(WheelOdometer, AWrongScaleIsTold) {
  WheelCourse course;
  course.says = [](double s) { return 1.2 * true_speed(s); };
  course.run();
  EXPECT_NEAR(course.odometer->speeds().compared_wheels_m / course.odometer->speeds().compared_pos_m, 1.2, 0.01);
  EXPECT_GT(course.count(FaultKind::Implausible), 10u);
}

TEST(WheelOdometer, SilenceIsTold) {
  WheelCourse course;
  course.is_lost = [](double s) { return s > 30 && s < 33; };
  course.counts = true;
  course.run();
  EXPECT_EQ(course.count(FaultKind::Silent), 1u) << course.details();
  EXPECT_EQ(course.count(FaultKind::Implausible), 0u) << course.details();
  EXPECT_NEAR(course.odometer->pulses().wheels_m, true_way(59.983), 0.2) << "pulses go on counting";
  EXPECT_NEAR(course.odometer->speeds().wheels_m, true_way(59.983) - 24, 0.5);
}

TEST(WheelOdometer, APosThatIsNotGoodIsNoJudge) {
  WheelCourse course;
  course.pos_is_good = false;
  course.says = [](double) { return 3.0; };
  course.run(seconds(20));
  EXPECT_EQ(course.count(FaultKind::Implausible), 0u);
  EXPECT_EQ(course.odometer->speeds().compared_s, 0);
  EXPECT_EQ(course.out.size(), course.truth.size());
}

TEST(WheelOdometer, ConfigIsChecked) {
  const auto wrong = [](auto change) {
    WheelOdometer::Config c;
    change(c);
    return c.validate();
  };
  EXPECT_EQ(wrong([](auto&) {}), "");
  EXPECT_NE(wrong([](auto& c) { c.stamp_sigma = nanoseconds(0); }), "");
  EXPECT_NE(wrong([](auto& c) { c.age = seconds(2); }), "");
  EXPECT_NE(wrong([](auto& c) { c.window = ms(1); }), "");
  EXPECT_NE(wrong([](auto& c) { c.tolerance_m = 0; }), "");
}

}  // namespace
}  // namespace hueline::sync
