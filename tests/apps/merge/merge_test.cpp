// A simulated drive that two computers recorded: merged and replayed, it is that of one computer with all sensors.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/merge/merge_plan.hpp"
#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "drivers/pps/pps_packet.hpp"
#include "runtime/ingest.hpp"
#include "runtime/outputs.hpp"
#include "runtime/pipeline.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"
#include "sim/wire/timeline.hpp"
#include "storage/journal_part.hpp"
#include "storage/journal_writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/sync/simulated_time.hpp"

namespace hueline::test {
namespace {

using apps::MergeWish;
using testing::HasSubstr;
using Names = std::set<std::string>;

/// Moves the clock of a computer.
using Restate = std::function<HostTime(HostTime)>;

class TwoComputers : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    sim::Scenario scenario = config::load_scenario(HUELINE_SOURCE_DIR "/tests/scenarios/short_flawless.yaml");
    scenario.laser.dropout_probability = 0.99;
    const auto drive =
        sim::generate(scenario, (std::filesystem::temp_directory_path() / "hueline-merge-drive").string());
    ASSERT_TRUE(drive.ok()) << drive.error().message;
    vehicle_ = new std::string(apps::simulated_rig(scenario, {}, "lens"));
    all_with_pps_ = new std::vector<Packet>(packets_of(scenario, *drive, {}));
    // A scanner without pulses is stamped by its arrivals alone.
    all_without_ = new std::vector<Packet>(
        packets_of(scenario, *drive, {sim::FaultLine::usual(sim::FaultType::LaserPpsLoss, 0, 30)}));
    ASSERT_GT(all_with_pps_->size(), 1000u);
  }
  static std::vector<Packet> packets_of(const sim::Scenario& scenario, const sim::Drive& drive,
                                        const std::vector<sim::FaultLine>& faults) {
    sim::TimelineConfig config;
    config.laser_model = scenario.laser.model;
    const auto made = sim::build_faulty_timeline(drive, config, faults);
    EXPECT_TRUE(made.ok());
    std::vector<Packet> out;
    EXPECT_TRUE(apps::for_each_simulated_packet(drive, made->timeline, config::parse_rig(*vehicle_, "vehicle"),
                                                [&](const Packet& packet) {
                                                  out.push_back(packet);
                                                  return true;
                                                })
                    .ok());
    // A computer takes packets in the order of their stamps here; which of two comes first is otherwise chance.
    std::ranges::stable_sort(out, {}, &Packet::received);
    return out;
  }

  /// Returns the vehicle's rig with some of its sensors.
  static std::string rig_of(const Names& names, const std::function<void(YAML::Node)>& change = {}) {
    YAML::Node rig = YAML::Load(*vehicle_);
    YAML::Node sensors(YAML::NodeType::Sequence);
    for (const auto& sensor : rig["sensors"])
      if (names.contains(sensor["name"].Scalar())) sensors.push_back(sensor);
    rig["sensors"] = sensors;
    if (!names.contains("camera")) rig.remove("head");
    if (change) change(rig);
    return YAML::Dump(rig);
  }

  /// Writes what a computer with that rig records of the drive.
  std::string record(const std::string& name, const std::string& rig_text, const Restate& restate = {},
                     const std::function<bool(const std::string& sensor, std::uint64_t number)>& is_lost = {}) {
    const config::Rig vehicle = config::parse_rig(*vehicle_, "vehicle"), rig = config::parse_rig(rig_text, name);
    std::vector<SensorId> numbers(vehicle.sensors.size() + 1);
    for (const auto& own : rig.sensors)
      for (const auto& sensor : vehicle.sensors)
        if (own.name == sensor.name) numbers[sensor.id] = own.id;
    runtime::PacketQueue record({1'000'000}), pipeline({1'000'000});
    runtime::Ingest ingest(std::vector<runtime::Ingest::Sensor>(rig.sensors.size() + 1), record, pipeline, {1'000'000});
    const std::string path = (folder_ / name).string();
    auto writer = storage::JournalWriter::create(path, runtime::journal_header(rig));
    EXPECT_TRUE(writer.ok()) << writer.error().message;
    std::map<std::string, std::uint64_t> count;
    const auto write = [&] {
      while (record.size() > 0) {
        const PacketPtr packet = *record.pop();
        const std::string sensor = packet->sensor > 0 ? rig.sensors[packet->sensor - 1u].name : "hueline";
        if (packet->kind == PacketKind::Wire && is_lost && is_lost(sensor, count[sensor]++)) continue;
        EXPECT_TRUE(writer->append(*packet, nanoseconds(0)).ok());
      }
      while (pipeline.size() > 0) pipeline.pop();
    };
    for (std::size_t i = 0; i < packets_->size(); ++i) {
      Packet packet = (*packets_)[i];
      packet.sensor = numbers[packet.sensor];
      if (packet.sensor == kSystemSensor) continue;
      if (restate) {
        packet.received = restate(packet.received);
        if (rig.sensors[packet.sensor - 1u].name == "pps") {
          auto edge = drivers::decode_pps(packet.bytes.bytes());
          EXPECT_TRUE(edge.ok());
          edge->time = packet.received;
          packet.bytes = Buffer::copy_of(drivers::encode_pps(*edge));
        }
      }
      ingest.submit(std::move(packet));
      if (i % 500 == 0) ingest.submit_ledger();
      write();
    }
    ingest.tell_the_rest({});
    write();
    EXPECT_TRUE(writer->close().ok());
    return path;
  }
  std::string record_single() { return record("single.mcap", *vehicle_); }

  MergeWish wish(std::vector<std::string> recordings, const std::string& rig = *vehicle_) const {
    MergeWish out;
    out.recordings = std::move(recordings);
    out.rig = config::parse_rig(rig, "vehicle.yaml");
    out.rig_name = "vehicle.yaml";
    return out;
  }
  static Result<apps::MergePlan> plan(const MergeWish& wish) {
    std::vector<apps::SurveyedJournal> journals;
    for (const std::string& name : wish.recordings) {
      auto one = apps::survey_journal(name, {});
      if (!one.ok()) return one.error();
      journals.push_back(std::move(*one));
    }
    return apps::plan_merge(wish, std::move(journals));
  }
  std::string merge(const MergeWish& wish) {
    auto made = plan(wish);
    EXPECT_TRUE(made.ok()) << made.error().message;
    if (!made.ok()) return {};
    remarks_ = made->remarks;
    warnings_ = made->warnings;
    relation_ = made->inputs.back().clock;
    std::string path = (folder_ / "merged.mcap").string();
    const auto merged = runtime::merge_journals(made->inputs, made->header, path, {});
    EXPECT_TRUE(merged.ok()) << merged.error().message;
    return path;
  }
  static std::string refusal(const MergeWish& wish) {
    const auto made = plan(wish);
    return made.ok() ? std::string("merged") : made.error().message;
  }

  struct Cloud : runtime::ProductSink {
    std::vector<ColouredPoint> points;
    void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override {
      points.insert(points.end(), block.points.begin(), block.points.end());
    }
  };
  template <class Use>
  static config::Rig each(const std::string& path, const Use& use) {
    auto recording = runtime::Recording::open(path);
    EXPECT_TRUE(recording.ok()) << recording.error().message;
    config::Rig rig = recording->rig;
    use(rig, *recording);
    return rig;
  }
  /// The packets of a recording's devices: which sensor, when, and their bytes.
  static std::vector<std::tuple<SensorId, HostTime, std::string>> packets(const std::string& path) {
    std::vector<std::tuple<SensorId, HostTime, std::string>> out;
    each(path, [&](const config::Rig&, runtime::Recording& recording) {
      read_whole(recording, [&](const Packet& packet) {
        const auto bytes = packet.bytes.bytes();
        if (packet.kind == PacketKind::Wire)
          out.emplace_back(packet.sensor, packet.received,
                           std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
      });
    });
    EXPECT_GT(out.size(), 1000u);
    return out;
  }
  template <class Take>
  static void read_whole(runtime::Recording& recording, Take take) {
    EXPECT_TRUE(recording
                    .for_each([&](const Packet& packet) {
                      take(packet);
                      return true;
                    })
                    .ok());
  }
  static void process(const config::Rig& rig, runtime::Recording& recording, runtime::ProductSink& products) {
    runtime::Pipeline pipeline(rig, 1, products);
    read_whole(recording, [&](const Packet& packet) { pipeline.process(packet); });
    pipeline.flush();
  }
  /// Replays a recording, and returns the bytes of its cloud.
  std::string replay(const std::string& path) {
    const std::filesystem::path out = folder_ / "out";
    each(path, [&](const config::Rig& rig, runtime::Recording& recording) {
      auto outputs = runtime::Outputs::create(rig, out, [](const std::string&) {});
      ASSERT_TRUE(outputs.ok());
      process(rig, recording, **outputs);
      EXPECT_TRUE((*outputs)->finish().ok());
    });
    return contents(out / "cloud.las");
  }
  static std::vector<ColouredPoint> points(const std::string& path) {
    Cloud cloud;
    each(path, [&](const config::Rig& rig, runtime::Recording& recording) { process(rig, recording, cloud); });
    return std::move(cloud.points);
  }

  TemporaryFolder folder_;
  std::vector<std::string> remarks_, warnings_;
  sync::ClockRelation relation_;
  static inline std::string* vehicle_ = nullptr;
  static inline std::vector<Packet>*all_with_pps_ = nullptr, *all_without_ = nullptr;
  const std::vector<Packet>* packets_ = all_with_pps_;
};

const Names kFirst{"pps", "pos", "laser"}, kSecond{"pps", "pos", "camera"};

/// Another computer, that was started hours later, or earlier.
Restate moved(nanoseconds by) {
  return [by](HostTime t) { return t + by; };
}
/// Another computer, whose oscillator is faster, and whose edges have a jitter of their own.
Restate moved(nanoseconds by, double rate, double jitter_us = 0) {
  auto random = std::make_shared<Random>(3);
  return [=](HostTime t) {
    const double since = static_cast<double>((t - apps::kSimulatedHostBegin).count());
    return t + by + nanoseconds(std::llround(rate * since)) + us(random->gauss(jitter_us));
  };
}

TEST_F(TwoComputers, WithAConstantOffsetTheCloudIsTheSameToTheByte) {
  const std::string single = replay(record_single());
  ASSERT_GT(single.size(), 500'000u);
  const std::string a = record("a.mcap", rig_of(kFirst));
  const std::string b = record("b.mcap", rig_of(kSecond), moved(std::chrono::hours(3) + nanoseconds(123'456'789)));
  const std::string merged = merge(wish({a, b}));
  EXPECT_EQ(replay(merged), single);
  EXPECT_THAT(remarks_[1], HasSubstr("-10800.123456789 s"));
  // The clock of either computer may be kept.
  const std::string c = record("c.mcap", rig_of(kSecond));
  const std::string d = record("d.mcap", rig_of(kFirst), moved(-std::chrono::minutes(10) + nanoseconds(1)));
  EXPECT_TRUE(packets(merge(wish({c, d}))) == packets((folder_ / "single.mcap").string()));
}

/// How two clouds of the same returns differ.
struct Difference {
  std::size_t found = 0, other_colour = 0, other_exposure = 0;
  double time_s = 0, place_m = 0;  // the largest
};
Difference compare(const std::vector<ColouredPoint>& single, const std::vector<ColouredPoint>& joined) {
  Difference out;
  const auto by_time = [](const ColouredPoint& point) { return std::tuple(point.channel, point.time); };
  std::vector<ColouredPoint> sorted = single;
  std::ranges::sort(sorted, {}, by_time);
  for (const ColouredPoint& point : joined) {
    const auto after = std::ranges::lower_bound(sorted, by_time(point), {}, by_time);
    const ColouredPoint* nearest = nullptr;
    for (auto at = after == sorted.begin() ? after : after - 1; at != sorted.end() && at <= after; ++at)
      if (at->channel == point.channel &&
          (!nearest || std::chrono::abs(at->time - point.time) < std::chrono::abs(nearest->time - point.time)))
        nearest = &*at;
    // Two firings of one channel are 50 us or more apart.
    if (!nearest || std::chrono::abs(nearest->time - point.time) > us(25)) continue;
    ++out.found;
    out.time_s = std::max(out.time_s, std::abs(to_seconds(point.time - nearest->time)));
    out.place_m = std::max(
        out.place_m, std::hypot(point.east - nearest->east, point.north - nearest->north, point.up - nearest->up));
    out.other_exposure += point.exposure != nearest->exposure;
    out.other_colour +=
        std::tie(point.red, point.green, point.blue) != std::tie(nearest->red, nearest->green, nearest->blue);
  }
  return out;
}

TEST_F(TwoComputers, WithAnotherRateTheCloudOfALockedScannerIsTheSame) {
  const std::vector<ColouredPoint> single = points(record_single());
  const std::string a = record("a.mcap", rig_of(kSecond));
  const std::string b = record("b.mcap", rig_of(kFirst), moved(std::chrono::hours(3), 20e-6, 2));
  const Difference difference = compare(single, points(merge(wish({a, b}))));
  EXPECT_NEAR(relation_.rate() * 1e6, -20, 1);
  EXPECT_EQ(difference.found, single.size());
  EXPECT_EQ(difference.time_s, 0) << "a scanner with pulses is stamped by its own clock";
  EXPECT_EQ(difference.place_m, 0);
  EXPECT_EQ(difference.other_colour, 0u);
}

TEST_F(TwoComputers, WithAnotherRateAFreeScannerIsTheSameWithinTheSigmaOfTheRelation) {
  packets_ = all_without_;
  const std::vector<ColouredPoint> single = points(record_single());
  const std::string a = record("a.mcap", rig_of(kSecond));
  const std::string b = record("b.mcap", rig_of(kFirst), moved(std::chrono::hours(3), 20e-6, 2));
  const Difference difference = compare(single, points(merge(wish({a, b}))));
  nanoseconds sigma{0};
  for (const auto& knot : relation_.knots()) sigma = std::max(sigma, nanoseconds(std::llround(knot.sigma_ns)));
  fmt::print(
      "{} of {} points found, largest difference of time {:.3g} us at a sigma of {:.3g} us, of place {:.3g} mm; {} "
      "have "
      "another exposure, {} another colour\n",
      difference.found, single.size(), difference.time_s * 1e6, to_seconds(sigma) * 1e6, difference.place_m * 1e3,
      difference.other_exposure, difference.other_colour);
  EXPECT_GT(single.size(), 1000u);
  EXPECT_EQ(difference.found, single.size());
  EXPECT_LT(difference.time_s, 5 * to_seconds(sigma));
}

TEST_F(TwoComputers, WhatIsMissingInOneIsMissingByName) {
  const std::string a = record("a.mcap", rig_of(kFirst), {}, [](const std::string& sensor, std::uint64_t number) {
    return sensor == "laser" && number % 50 == 7;
  });
  const std::string b = record("b.mcap", rig_of(kSecond), moved(std::chrono::hours(1)),
                               [](const std::string& sensor, std::uint64_t number) {
                                 return (sensor == "camera" && number == 9) || (sensor == "pos" && number % 40 == 7);
                               });
  runtime::LedgerCheck check(false);
  const config::Rig rig = each(merge(wish({a, b})), [&](const config::Rig&, runtime::Recording& recording) {
    read_whole(recording, [&](const Packet& packet) { check.take(packet); });
  });
  check.finish();
  EXPECT_EQ(check.contradictions(), 0u);
  for (const auto& sensor : rig.sensors) {
    const std::uint64_t missing = check.accounts()[sensor.id].missing;
    if (sensor.name == "laser") {
      EXPECT_GT(missing, 20u);
    } else {
      EXPECT_EQ(missing, sensor.name == "camera" ? 1u : 0u) << sensor.name << ": the first one's POS is kept";
    }
  }
}

TEST_F(TwoComputers, TheMergedRecordingSaysWhatItIsMadeOf) {
  const std::string a = record("a.mcap", rig_of(kFirst)), b = record("b.mcap", rig_of(kSecond), moved(ms(5)));
  each(merge(wish({a, b})), [&](const config::Rig& rig, runtime::Recording& recording) {
    EXPECT_EQ(rig.text, *vehicle_);
    const storage::JournalHeader& header = recording.journal->header();
    EXPECT_THAT(header.about.at("merged_from"), HasSubstr("a.mcap (pps, pos, laser)"));
    std::map<std::string, std::string> files;
    for (const auto& file : header.files) files[file.name] = file.text;
    EXPECT_EQ(files.at("rig_2.yaml"), rig_of(kSecond));
    const auto told = YAML::Load(files.at("merge.json"))["recordings"];
    EXPECT_TRUE(told[0]["clock"]["is_first"].as<bool>());
    EXPECT_EQ(told[1]["clock"]["by"].as<std::string>(), "pulses");
    EXPECT_EQ(told[1]["clock"]["knots"][0]["offset_ns"].as<std::int64_t>(), -5'000'000);
  });
}

TEST_F(TwoComputers, WhatTheRecordingsLeaveOpenIsRefusedOrChosen) {
  const std::string a = record("a.mcap", rig_of(kFirst));
  const std::string both = record("both.mcap", *vehicle_, moved(ms(7)));
  MergeWish twice = wish({a, both});
  EXPECT_THAT(refusal(twice), HasSubstr("both have packets of the sensor laser: say from which"));
  twice.take = {"laser=3"};
  EXPECT_THAT(refusal(twice), HasSubstr("from 1 to 2"));
  twice.take = {"lasser=2"};
  EXPECT_THAT(refusal(twice), HasSubstr("has no sensor lasser"));
  twice.take = {"pps=2", "laser=1"};
  EXPECT_THAT(refusal(twice), HasSubstr("name the recording first whose pulses"));
  twice.take = {"laser=2"};
  EXPECT_TRUE(packets(merge(twice)) == packets(record_single()));

  const std::string b = record("b.mcap", rig_of(kSecond), moved(ms(7)));
  MergeWish lacking = wish({a, b}, rig_of(kFirst));
  EXPECT_THAT(refusal(lacking), HasSubstr("b.mcap has a sensor camera that vehicle.yaml lacks"));
  lacking.without = {"camra"};
  EXPECT_THAT(refusal(lacking), HasSubstr("there are: camera, laser, pos, pps"));
  lacking.without = {"camera"};
  EXPECT_EQ(refusal(lacking), "merged");

  const std::string other = rig_of(kSecond, [](YAML::Node rig) {
    for (auto sensor : rig["sensors"])
      if (sensor["name"].Scalar() == "camera") sensor["exposure_us"] = 1500;
  });
  MergeWish differing = wish({a, record("other.mcap", other, moved(ms(7)))});
  EXPECT_THAT(refusal(differing), HasSubstr("the sensor camera has exposure_us: 1500"));
  differing.rig_decides = true;
  EXPECT_EQ(refusal(differing), "merged");
}

TEST_F(TwoComputers, PartsOfARecordingBecomeItAgain) {
  const std::string single = record_single();
  const HostTime begin = std::get<HostTime>(packets(single).front()), end = std::get<HostTime>(packets(single).back());
  const double half_s = to_seconds(end - begin) / 2;
  const auto part = [&](const char* name, const storage::JournalPart& which) {
    std::string path = (folder_ / name).string();
    each(single, [&](const config::Rig&, runtime::Recording& recording) {
      EXPECT_TRUE(storage::copy_part(*recording.journal, single, which, path).ok());
    });
    return path;
  };
  const std::string a = part("front.mcap", {.from_s = 0, .to_s = half_s}), b = part("back.mcap", {.from_s = half_s});
  MergeWish parts = wish({a, b});
  parts.is_same_clock = true;
  EXPECT_TRUE(packets(merge(parts)) == packets(single));
  EXPECT_THAT(remarks_[1], HasSubstr("back.mcap: pps, pos, laser, camera; the same clock"));
  parts.recordings = {b, a};
  EXPECT_TRUE(packets(merge(parts)) == packets(single));
  // A sensor that is asked for from one of them comes from that one.
  parts.take = {"pos=2"};
  merge(parts);
  EXPECT_THAT(remarks_[0], HasSubstr("left out: pos"));
  // What overlaps is of two devices, or there twice.
  MergeWish overlapping = wish({part("most.mcap", {.from_s = 0, .to_s = half_s + 1}), b});
  overlapping.is_same_clock = true;
  EXPECT_THAT(refusal(overlapping), HasSubstr("both have packets of the sensor"));
}

TEST_F(TwoComputers, TicksAreThoseOfOneComputer) {
  const auto ticks = [&](bool is_same_clock, nanoseconds later) {
    std::vector<std::string> names;
    for (const nanoseconds at : {nanoseconds(0), later}) {
      names.push_back((folder_ / fmt::format("ticks{}-{}.mcap", names.size(), count_ns(HostTime(later)))).string());
      auto writer = storage::JournalWriter::create(names.back(),
                                                   runtime::journal_header(config::parse_rig(*vehicle_, "vehicle")));
      EXPECT_TRUE(writer.ok());
      for (std::uint64_t i = 0; i < 3; ++i) {
        Packet tick;
        tick.kind = PacketKind::Tick;
        tick.sequence = i;
        tick.received = HostTime(at + std::chrono::seconds(1 + i));
        EXPECT_TRUE(writer->append(tick, nanoseconds(0)).ok());
      }
      EXPECT_TRUE(writer->close().ok());
    }
    MergeWish both = wish(names);
    both.is_same_clock = is_same_clock;
    std::size_t count = 0;
    each(merge(both), [&](const config::Rig&, runtime::Recording& recording) {
      read_whole(recording, [&](const Packet& packet) { count += packet.kind == PacketKind::Tick; });
    });
    return count;
  };
  EXPECT_EQ(ticks(true, std::chrono::seconds(10)), 6u) << "one computer's, one part after the other";
  EXPECT_EQ(ticks(true, std::chrono::seconds(1)), 3u) << "those of one of two at the same time";
}

TEST_F(TwoComputers, WithoutPulsesArrivalsJoinThemToMilliseconds) {
  const std::string a = record("a.mcap", rig_of(kFirst));
  const nanoseconds offset = std::chrono::hours(5) + ms(1.5);
  merge(wish({a, record("b.mcap", rig_of({"pos", "camera"}), moved(offset, 20e-6))}));
  EXPECT_THAT(remarks_[1], HasSubstr("by arrivals of messages"));
  EXPECT_THAT(warnings_, testing::Contains(HasSubstr("b.mcap: the sigma of its restated times reaches")));
  const Restate clock = moved(offset, 20e-6);
  for (int s = 0; s < 20; ++s) {
    const HostTime t = apps::kSimulatedHostBegin + std::chrono::seconds(s);
    const sync::OtherTime there(clock(t).time_since_epoch());
    EXPECT_LT(std::chrono::abs(relation_.convert(there) - t), 3 * relation_.sigma(there)) << s;
    EXPECT_LT(relation_.sigma(there), ms(20)) << s;
  }
}

TEST_F(TwoComputers, ClocksThatCannotBeRelatedAreRefused) {
  const std::string a = record("a.mcap", rig_of(kFirst));
  const auto no_pulses = [](const std::string& sensor, std::uint64_t) { return sensor == "pps"; };
  EXPECT_THAT(refusal(wish({a, record("b.mcap", rig_of(kSecond), moved(ms(7)), no_pulses)})),
              HasSubstr("b.mcap has none: no pulse came"));
  const auto no_pos = [](const std::string& sensor, std::uint64_t) { return sensor == "pos"; };
  EXPECT_THAT(refusal(wish({a, record("c.mcap", rig_of(kSecond), moved(ms(7)), no_pos)})),
              HasSubstr("no message with a good GPS time"));
  // Two drives of other days have no second in common.
  const auto first_half = [](const std::string&, std::uint64_t number) { return number > 6; };
  EXPECT_THAT(refusal(wish({a, record("d.mcap", rig_of({"pps", "pos"}), moved(ms(7)), first_half)})),
              HasSubstr("seconds of GPS time in common"));
  // One clock that is none.
  MergeWish same = wish({a, record("e.mcap", rig_of(kSecond), moved(ms(7)))});
  same.is_same_clock = true;
  EXPECT_THAT(refusal(same), HasSubstr("their clocks differ by -0.007"));
  MergeWish truly = wish({a, record("f.mcap", rig_of(kSecond))});
  truly.is_same_clock = true;
  EXPECT_TRUE(packets(merge(truly)) == packets(record_single()));
}

}  // namespace
}  // namespace hueline::test
