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

/// A change of a clock's state, for the log, the recording and the console.
struct SyncStateChange {
  SensorId clock = kSystemSensor;  ///< the sensor whose clock it is; for the host's clock, the PPS sensor
  HostTime at{};                   ///< `received` of the packet that caused the change
  std::optional<GpsTime> time;     ///< the same instant in GPS time, if it is known
  SyncState from = SyncState::Unlocked, to = SyncState::Unlocked;
  nanoseconds sigma{0};  ///< one sigma of the clock's relation to GPS time after the change; 0 if there is none
};

/// The results of calls of the Synchroniser. Each call appends to them; the caller clears them.
struct SyncOutput {
  std::vector<StampedLaserBatch> laser;   ///< for each sensor in order of arrival
  std::vector<Exposure> exposures;        ///< of all cameras together, in order of time, with consecutive indices
  std::vector<InsSolution> ins;           ///< with the POS's GPS time, checked; sigma is filled in from InsUncertainty
  std::vector<StampedWheelSpeed> wheels;  ///< for each sensor in order of arrival
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

/// The stage between decoders and fusion. It receives the measurements of a whole rig in the order of ingest, and
/// returns them in GPS time, with sigma and clock state.
///
/// Measurements that cannot be stamped yet are held, within limits, and stamped when the clock locks. Measurements that
/// can never be stamped are counted and reported by a NoTime fault. A navigation solution has a time of its own and
/// waits only where the clock was known and is lost, mostly because sources disagree about the second.
/// The stage reads no clock and no file and starts no thread, so the same input always gives the same output. Thread
/// safety: one thread per object.
///
/// With Config::self_timed, all measurements come from files, whose arrivals have no common time base. Then there is no
/// clock of the computer to learn: each scanner is stamped by its own clock (SelfTimedLaser), and the stream time is
/// what the devices say. An image has the time that it gives itself (a TimedArrival of its sensor with the same
/// `received`, or its counter with ExposureMatcher::Config::counter_offset). That time stands for the arrival by which
/// the image finds its event mark; without event input it is the time of the exposure.
class Synchroniser {
 public:
  struct Config {
    HostClockModel::Config clock;            ///< clock.pps is the PPS sensor; clock.label.trusted is normally the POS
    std::vector<SensorId> label_sources;     ///< sensors whose TimeLabels are used; empty: all
    std::vector<SensorId> arrival_sources;   ///< sensors whose timed messages are used as arrivals; empty: all
    bool self_timed = false;                 ///< every sensor is read from a file
    SensorId pos = kSystemSensor;            ///< the sensor whose InsSolutions and EventMarks are used; 0: all
    std::vector<LaserClock::Config> lasers;  ///< one for each scanner
    std::vector<ExposureMatcher::Config> cameras;  ///< one for each camera head
    std::vector<WheelOdometer::Config> wheels;     ///< one for each wheel encoder
    /// How long measurements are held while they cannot be stamped, in stream time; [1, 600].
    std::chrono::seconds hold{30};
    /// How many batches, marks, images, statuses, solutions and wheel speeds are held at most; [100, 1e7].
    std::size_t hold_items = 100'000;
    /// Memory for what is held, bytes: 16 million returns. The pixels of images are not counted, because they lie in
    /// the recorder's pool; [1e6, 1e12].
    std::size_t hold_bytes = 512'000'000;
    /// How many images are held at most, the newest; each keeps its buffer in use. [1, 1000].
    std::size_t hold_images = 16;
    /// A solution or mark that arrives later than this after its own time has a wrong time.
    nanoseconds pos_latency_max{std::chrono::seconds(2)};
    /// A solution or mark that arrives earlier than this before its own time has a wrong time.
    nanoseconds pos_early{std::chrono::milliseconds(50)};
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit Synchroniser(Config config);

  /// Processes one measurement and appends what becomes ready to `out`. Call it for every measurement in order of
  /// ingest, not only for laser batches and images: any measurement can complete a time stamp for which others wait.
  void process(Measurement measurement, SyncOutput& out);
  /// Tells that time has passed until `received`. Call it for packets from which nothing was decoded, such as ticks of
  /// a watchdog.
  void advance(HostTime received, SyncOutput& out);
  /// Ends the stream: returns everything that is held, or reports why it has no time.
  void flush(SyncOutput& out);

  SyncState state() const { return clock_.state(); }
  const HostClockModel& clock() const { return clock_; }
  /// Returns the GPS time of the newest packet's `received`; it never decreases. Empty until something could be
  /// stamped.
  std::optional<GpsTime> stream_time() const { return stream_time_; }
  /// Returns a time before which no laser batch and no exposure will be returned any more, as long as deliveries keep
  /// their latency limits. It never decreases. Empty until something could be stamped.
  std::optional<GpsTime> watermark() const { return watermark_; }

  struct Counts {
    std::uint64_t measurements = 0, unknown_sensor = 0, held = 0, released = 0, never_stamped = 0;
    std::uint64_t returns = 0;                     ///< laser returns received
    std::map<std::string, std::uint64_t> untimed;  ///< returns that got no time, by reason
    std::uint64_t ins = 0, ins_refused = 0, ins_missing = 0, marks_refused = 0;
  };
  const Counts& counts() const { return counts_; }
  const std::vector<LaserClock>& lasers() const { return lasers_; }
  const std::vector<SelfTimedLaser>& self_timed_lasers() const { return self_timed_; }
  const std::vector<ExposureMatcher>& cameras() const { return cameras_; }
  const std::vector<WheelOdometer>& wheels() const { return wheels_; }

 private:
  /// std::monostate stands where an image was that is no longer held.
  using Held = std::variant<std::monostate, LaserStatus, LaserBatch, Image, EventMark, InsSolution, WheelSpeed>;
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
  void take_image_of_file(Image& m, std::size_t camera);
  void take(WheelSpeed& m, SyncOutput& out);
  void take(Fault& m, SyncOutput& out);

  void arrived(SensorId sensor, HostTime received, GpsTime time);
  std::optional<std::string> off_arrival(HostTime received, GpsTime time) const;
  void judge(InsSolution&& m, SyncOutput& out);
  void give(InsSolution&& m, SyncOutput& out);
  void hold(Held item);
  Held release_oldest();
  void drop_oldest(const char* why, SyncOutput& out);
  void drop_oldest_image();
  void count_dropped(const Held& item, const char* why);
  void stamp(Held&& item, SyncOutput& out);
  LaserClock* laser(SensorId sensor);
  SelfTimedLaser* self_timed(SensorId sensor);
  ExposureMatcher* camera(SensorId sensor, std::size_t* index = nullptr);
  WheelOdometer* wheel(SensorId sensor);
  void report_unknown_sensor(SensorId sensor, HostTime received, const char* what);
  /// Does everything that follows from the passing of time. It is called after each measurement.
  void settle(HostTime received, SyncOutput& out);
  void settle_self_timed(SyncOutput& out);

  Config config_;
  HostClockModel clock_;
  std::vector<LaserClock> lasers_;
  std::vector<SelfTimedLaser> self_timed_;    // used instead of lasers_ with Config::self_timed
  std::vector<SyncState> self_timed_states_;  // the states last reported
  std::vector<ExposureMatcher> cameras_;
  std::vector<WheelOdometer> wheels_;
  std::vector<std::optional<TimedArrival>> told_;  // by camera: the time that its latest image of a file gives itself
  ExposureMerger exposures_;
  std::vector<Exposure> scratch_;  // used within one call
  FaultLog faults_;
  Counts counts_;
  std::deque<Held> held_;
  std::deque<std::uint64_t> held_images_;  // their places in held_, counted from the first item that was ever held
  std::uint64_t released_items_ = 0;       // so many are no longer in held_
  std::size_t held_bytes_ = 0;
  std::vector<InsUncertainty> uncertainties_;  // the newest of each sensor
  SolutionWatch solutions_;
  SyncState known_state_ = SyncState::Unlocked;
  std::optional<GpsTime> stream_time_, watermark_;
  std::optional<GpsTime> newest_solution_;
  HostTime newest_{};
};

}  // namespace hueline::sync
