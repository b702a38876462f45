#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/stamped.hpp"
#include "sync/exposure_matcher.hpp"
#include "sync/exposure_merger.hpp"
#include "sync/fault_log.hpp"
#include "sync/host_clock_model.hpp"
#include "sync/laser_clock.hpp"
#include "sync/self_timed_laser.hpp"
#include "sync/solution_watch.hpp"
#include "sync/wheel_odometer.hpp"

namespace hueline::sync {

/// The clock's state changed: for the log, the recording and the console.
struct SyncStateChange {
  SensorId clock = kSystemSensor;  ///< the sensor whose clock it is; that of the host: its PPS
  HostTime at{};                   ///< `received` of the packet that showed it
  std::optional<GpsTime> time;     ///< the same in GPS time, if there is a relation
  SyncState from = SyncState::Unlocked, to = SyncState::Unlocked;
  nanoseconds sigma{0};  ///< of the relation now; 0 if there is none
};

/// What one call of the stage gave. Appended to; the caller clears.
struct SyncOutput {
  std::vector<StampedLaserBatch> laser;   ///< by sensor in order of arrival
  std::vector<Exposure> exposures;        ///< all cameras together, in time order, indexed without a gap
  std::vector<InsSolution> ins;           ///< GPS time as the POS gave it, checked; sigma filled from InsUncertainty
  std::vector<StampedWheelSpeed> wheels;  ///< by sensor in order of arrival
  std::vector<SyncStateChange> state_changes;
  std::vector<Fault> faults;
  void clear() {
    laser.clear();
    exposures.clear();
    ins.clear();
    wheels.clear();
    state_changes.clear();
    faults.clear();
  }
};

/// The stage between decoders and fusion: measurements of a whole rig in the order of ingest -> the same in GPS time
/// with sigma and state. What cannot be stamped yet is held, bounded, and stamped when the clock locks; what never can
/// is counted and named by a NoTime or Overflow fault. No clock, no thread, no file: the same input gives the same
/// output. Reentrant.
///
/// With `self_timed` there is no clock of the computer to learn: the measurements were read from files, whose arrivals
/// have nothing in common. Each scanner is stamped by its own clock (SelfTimedLaser), and the stream's time is what its
/// devices say.
class Synchroniser {
 public:
  struct Config {
    HostClockModel::Config clock;                  ///< clock.pps: the PPS sensor; clock.label.trusted: normally the POS
    std::vector<SensorId> label_sources;           ///< sensors whose TimeLabel counts; empty: all
    std::vector<SensorId> arrival_sources;         ///< sensors whose timed messages bound the latency; empty: all
    bool self_timed = false;                       ///< every sensor is read from a file
    SensorId pos = kSystemSensor;                  ///< whose InsSolution and EventMark are used; 0: all
    std::vector<LaserClock::Config> lasers;        ///< one for each scanner
    std::vector<ExposureMatcher::Config> cameras;  ///< one for each camera head
    std::vector<WheelOdometer::Config> wheels;     ///< one for each wheel encoder
    std::chrono::seconds hold{30};                 ///< of stream time, held while nothing can be stamped; [1, 600]
    std::size_t hold_items = 100'000;              ///< batches, marks and status together; [100, 1e7]
    /// Memory of them, images' pixels left out (those lie in the recorder's pool): 16 M returns; [1e6, 1e12]
    std::size_t hold_bytes = 512'000'000;
    std::size_t hold_images = 16;                          ///< they pin their buffers; [1, 1000]
    nanoseconds pos_latency_max{std::chrono::seconds(2)};  ///< a solution later or ...
    nanoseconds pos_early{std::chrono::milliseconds(50)};  ///< ... earlier than this is labelled wrongly
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit Synchroniser(Config config);

  /// One measurement, in order of ingest. Appends to `out`. Not for LaserBatch and Image alone: everything may release
  /// something held.
  void process(Measurement measurement, SyncOutput& out);
  /// A packet that decoded to nothing still tells that time passes (watchdog ticks).
  void advance(HostTime received, SyncOutput& out);
  /// The end of the stream: gives out or names all that is held.
  void flush(SyncOutput& out);

  SyncState state() const { return clock_.state(); }
  const HostClockModel& clock() const { return clock_; }
  /// GPS time of the newest packet's `received`; never falls. Empty until something could be stamped.
  std::optional<GpsTime> stream_time() const { return stream_time_; }
  /// Laser batches and exposures still to come are not earlier than this, while deliveries keep to their latency
  /// limits. Never falls; empty until something could be stamped.
  std::optional<GpsTime> watermark() const { return watermark_; }

  struct Counts {
    std::uint64_t measurements = 0, unknown_sensor = 0, held = 0, released = 0, never_stamped = 0;
    std::uint64_t returns = 0;                     ///< laser returns that came in
    std::map<std::string, std::uint64_t> untimed;  ///< those that never got a time, by reason
    std::uint64_t ins = 0, ins_refused = 0, ins_missing = 0, marks_refused = 0;
  };
  const Counts& counts() const { return counts_; }
  const std::vector<LaserClock>& lasers() const { return lasers_; }
  const std::vector<SelfTimedLaser>& self_timed_lasers() const { return self_timed_; }
  const std::vector<ExposureMatcher>& cameras() const { return cameras_; }
  const std::vector<WheelOdometer>& wheels() const { return wheels_; }

 private:
  using Held = std::variant<LaserStatus, LaserBatch, Image, EventMark, WheelSpeed>;
  void take(PpsEdge& m, SyncOutput& out);
  void take(TimeLabel& m, SyncOutput& out);
  void take(TimedArrival& m, SyncOutput& out);
  void take(LaserStatus& m, SyncOutput& out);
  void take(InsSolution& m, SyncOutput& out);
  void take(InsUncertainty& m, SyncOutput& out);
  void take(GnssFix& m, SyncOutput& out);
  void take(ImuSample& m, SyncOutput& out);
  void take(EventMark& m, SyncOutput& out);
  void take(LaserBatch& m, SyncOutput& out);
  void take(Image& m, SyncOutput& out);
  void take(WheelSpeed& m, SyncOutput& out);
  void take(Fault& m, SyncOutput& out);

  void arrived(SensorId sensor, HostTime received, GpsTime time);
  void hold(Held item);
  Held release_oldest();
  void drop_oldest(FaultKind kind, const char* why);
  void stamp(Held&& item, SyncOutput& out);
  LaserClock* laser(SensorId sensor);
  SelfTimedLaser* self_timed(SensorId sensor);
  ExposureMatcher* camera(SensorId sensor, std::size_t* index = nullptr);
  WheelOdometer* wheel(SensorId sensor);
  void stranger(SensorId sensor, HostTime received, const char* what);
  /// Everything that follows from the passing of time, after each measurement.
  void settle(HostTime received, SyncOutput& out);
  void settle_self_timed(SyncOutput& out);

  Config config_;
  HostClockModel clock_;
  std::vector<LaserClock> lasers_;
  std::vector<SelfTimedLaser> self_timed_;    // instead of them, with Config::self_timed
  std::vector<SyncState> self_timed_states_;  // as told
  std::vector<ExposureMatcher> cameras_;
  std::vector<WheelOdometer> wheels_;
  ExposureMerger exposures_;
  std::vector<Exposure> scratch_;  // of the running call
  FaultLog faults_;
  Counts counts_;
  std::deque<Held> held_;
  std::size_t held_images_ = 0, held_bytes_ = 0;
  std::vector<InsUncertainty> uncertainties_;  // newest of each sensor
  SolutionWatch solutions_;
  SyncState known_state_ = SyncState::Unlocked;
  std::optional<GpsTime> stream_time_, watermark_;
  std::optional<GpsTime> newest_solution_;
  HostTime newest_{};
};

}  // namespace hueline::sync
