#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/score/score_recording.hpp"
#include "config/rig.hpp"
#include "runtime/summary.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/judge.hpp"

/// Runs a short simulated drive through the whole pipeline, with the faults of a scenario, and compares everything that
/// it gave with the truth.
namespace hueline::test {

/// The result of one run.
struct FaultyOutcome {
  struct Stamp {
    double error_us = 0, sigma_us = 0;  ///< error against the truth, and the claimed sigma
    bool is_locked = false;
  };
  std::map<std::uint32_t, Stamp> laser;      ///< by number of the packet in the drive
  std::map<std::uint32_t, Stamp> exposures;  ///< by number of the exposure; only those that were given a time
  std::uint64_t wheels = 0;                  ///< messages of the wheel encoder
  /// Of the times of these messages; without meaning if the host's clock is at fault.
  double largest_wheel_error_us = 0;
  std::uint64_t batches = 0, strange_batches = 0, unmatched_exposures = 0, images = 0;
  std::vector<std::string> wrong_stamps;  ///< stamps that are wrong by more than 5 sigma and 20 us, in words
  std::uint64_t wrong_laser = 0, wrong_exposures = 0;

  std::map<FaultKind, std::uint64_t> told;      ///< counts of reported faults by kind
  std::map<SensorId, std::uint64_t> told_lost;  ///< units that were reported as lost, by sensor
  std::uint64_t missing = 0;        ///< datagrams, logs, images, edges and frames that were sent and did not come
  std::vector<std::string> faults;  ///< the faults in words

  /// The points that were fired in a tenth of a second of drive time.
  struct Tenth {
    std::uint32_t points = 0, coloured = 0, judged = 0;
    std::uint32_t misplaced = 0;    ///< farther than 5 sigma and 0.3 m from their true place
    std::uint32_t wrong_pixel = 0;  ///< coloured by a pixel that is wrong by more than 2 degrees
  };
  std::vector<Tenth> tenths;
  Tenth sum(double from_s, double to_s) const;
  double largest_place_error_m = 0;

  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> bytes;  ///< bytes of each sensor: received, explained
  std::vector<std::size_t> hits;                                         ///< hits of each line
};

/// The result of a run on a computer whose disk or program failed.
struct RecordedOutcome {
  apps::SimulatedCapture capture;
  score::RecordingFacts facts;
};

/// Renders the drive once for all processes that use it.
class FaultyDrive {
 public:
  /// Times of the drive, in s after its beginning.
  static constexpr double kSensorsBegin = 10, kFaultBegin = 13, kFaultEnd = 15, kSensorsEnd = 19;
  static constexpr double kExposureInterval = 0.1;
  static FaultyDrive& shared();
  /// `Enter` is given each packet, and the function that processes it. Without it, packets are processed as they come.
  using Enter = std::function<void(const Packet&, const std::function<void(const Packet&)>& process)>;
  FaultyOutcome run(const std::vector<sim::FaultLine>& lines, const Enter& enter = {}) const;
  /// Captures the same drive onto a disk with these faults, and reads it back. `before_reading` may change the file in
  /// ways that no disk does.
  RecordedOutcome record(const std::vector<sim::FaultLine>& lines,
                         const std::function<void(const std::filesystem::path&)>& before_reading = {}) const;
  SensorId pos() const { return rig_.sync.pos; }
  SensorId pps() const { return rig_.sync.clock.pps; }
  std::size_t sensors() const { return rig_.sensors.size() + 1; }  // with hueline itself
  /// Returns the outcome without faults. It is run once in each process.
  const FaultyOutcome& clean();

 private:
  FaultyDrive();
  sim::FaultyTimeline timeline(const std::vector<sim::FaultLine>& lines) const;
  config::Rig rig_;
  sim::Scenario scenario_;
  sim::Drive drive_;
  std::unique_ptr<sim::Judge> judge_;
  std::unique_ptr<FaultyOutcome> clean_;
};

}  // namespace hueline::test
