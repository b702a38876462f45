#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/stamped.hpp"
#include "sync/fault_log.hpp"
#include "sync/host_clock_model.hpp"
#include "sync/labelled_time.hpp"
#include "sync/laser_discipline.hpp"

namespace hueline::sync {

/// A scanner whose packets' arrivals say nothing of GPS time, because they were read from a file: its own clock is all
/// there is. Locked to its reference, and with the second that it says it was, its stamp is GPS time to the scanner's
/// specification.
///
/// Batches are held until the scanner's labels have settled about what time it is (LabelledTime), bounded; then each is
/// stamped Locked while the scanner says that its clock is locked, and Holdover, with a growing sigma, when it does not
/// any more. What has no such time is counted by its reason and named by a fault. Reentrant.
class SelfTimedLaser {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    LaserDiscipline::Config discipline{};
    nanoseconds holdover_limit{std::chrono::milliseconds(1)};  ///< sigma at which its crystal is given up
    int agreeing = 3;                                          ///< labels that must agree; [1, 1000]
    GpsTime not_before{};                                      ///< an earlier label is a GPS week rollover
    nanoseconds hold{std::chrono::seconds(30)};                ///< of arrivals, before the labels are settled
    std::size_t hold_returns = 4'000'000;                      ///< likewise; 32 bytes each
    nanoseconds astray{std::chrono::seconds(5)};               ///< a stamp so far off its arrival is a passing error
  };
  explicit SelfTimedLaser(const Config& config)
      : config_(config), labels_(config.agreeing), discipline_(config.discipline) {}

  void add(const TimeLabel& label, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void add(const LaserStatus& status, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// `leaps` is asked for GPS - UTC alone. Appends to `out` in order of arrival.
  void process(LaserBatch batch, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// The files have been read up to `now`: what has been held for too long is decided.
  void advance(HostTime now, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// The end: what is held is judged by the labels that came.
  void flush(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  SensorId sensor() const { return config_.sensor; }
  SyncState state() const { return state_; }
  /// Of the newest batch that was stamped.
  std::optional<GpsTime> newest() const { return newest_; }
  /// Batches wait for labels, and may still be stamped.
  bool is_waiting() const { return !held_.empty(); }

  /// Returns that got no time, by reason.
  struct Counts {
    std::uint64_t never_locked = 0;  ///< the scanner never said that its clock is locked
    std::uint64_t lost_lock = 0;     ///< its reference was lost for longer than its crystal is good
    std::uint64_t no_label = 0;      ///< locked, but no valid label named the time
    std::uint64_t astray = 0;        ///< the stamp left its course
  };
  const Counts& counts() const { return counts_; }

 private:
  using Held = std::variant<LaserBatch, LaserStatus>;
  void take(Held&& item, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void stamp(LaserBatch&& batch, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void give_up(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void release(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void refuse(const LaserBatch& batch, std::uint64_t& counter, const char* topic, const char* why);
  void refuse_without_label(const LaserBatch& batch);

  Config config_;
  LabelledTime labels_;
  LaserDiscipline discipline_;
  FaultLog faults_;
  Counts counts_;
  std::deque<Held> held_;
  std::size_t held_returns_ = 0;
  bool gave_up_ = false;  // waiting for labels: from now on nothing is held
  bool was_locked_ = false, saw_rollover_ = false;
  std::optional<GpsTime> newest_;
  SyncState state_ = SyncState::Unlocked;
};

}  // namespace hueline::sync
