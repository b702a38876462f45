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
#include "sync/hour_label.hpp"

namespace hueline::sync {

/// A scanner whose packets' arrivals say nothing of GPS time, because they were read from a file: its own clock is all there is.
/// On PPS, and with the date and hour that the receiver at its input named, its counter is GPS time to the scanner's specification.
///
/// Batches are held until the hour is settled (HourLabel), bounded; then each is stamped Locked while the scanner says that its PPS
/// is locked, and Holdover, with a sigma grown by `drift_ppm`, when it does not any more. What has no such time is counted by its
/// reason and named by a fault. Reentrant.
class SelfTimedLaser {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    nanoseconds disciplined_sigma{std::chrono::microseconds(2)};   ///< of a scanner on PPS against GPS; > 0
    double drift_ppm = 20;                                         ///< of its crystal, one sigma; (0, 1000]
    nanoseconds holdover_limit{std::chrono::milliseconds(1)};      ///< sigma at which its crystal is given up
    std::chrono::seconds status_timeout{5};                        ///< without a position packet PPS counts as lost
    int agreeing = 3;                                              ///< labels that must agree on the hour; [1, 1000]
    GpsTime not_before{};                                          ///< an earlier label is a GPS week rollover
    nanoseconds hold{std::chrono::seconds(30)};                    ///< of arrivals, before the hour is settled
    std::size_t hold_returns = 4'000'000;                          ///< likewise; 32 bytes each
    nanoseconds astray{std::chrono::seconds(5)};                   ///< a counter so far off its arrival is a passing error
  };
  explicit SelfTimedLaser(const Config& config) : config_(config), hour_(config.agreeing) {}

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
  /// Batches wait for the hour, and may still be stamped.
  bool is_waiting() const { return !held_.empty(); }

  /// Returns that got no time, by reason.
  struct Counts {
    std::uint64_t never_locked = 0;   ///< the scanner never said that its PPS is locked
    std::uint64_t lost_pulse = 0;     ///< its PPS was lost for longer than its crystal is good
    std::uint64_t no_hour = 0;        ///< PPS, but no valid message named date and hour
    std::uint64_t astray = 0;         ///< the counter left its course
  };
  const Counts& counts() const { return counts_; }

 private:
  using Held = std::variant<LaserBatch, LaserStatus>;
  void take(Held&& item, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void stamp(LaserBatch&& batch, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void give_up(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void release(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void refuse(const LaserBatch& batch, std::uint64_t& counter, const char* topic, const char* why);
  void refuse_without_hour(const LaserBatch& batch);

  Config config_;
  HourLabel hour_;
  FaultLog faults_;
  Counts counts_;
  std::deque<Held> held_;
  std::size_t held_returns_ = 0;
  bool gave_up_ = false;  // waiting for the hour: from now on nothing is held
  bool was_locked_ = false, saw_rollover_ = false;
  std::optional<LaserStatus> status_;
  std::optional<GpsTime> last_disciplined_, newest_;
  SyncState state_ = SyncState::Unlocked;
};

}  // namespace hueline::sync
