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

/// Stamps a scanner that was read from a file. The arrivals of its packets say nothing about GPS time, so its own clock
/// is the only source. If the clock is locked to its reference and the scanner says which second it is, its stamp is
/// GPS time within the scanner's specification.
///
/// Batches are held, within limits, until the scanner's labels have settled the time (LabelledTime). Then each batch is
/// stamped: Locked while the scanner says that its clock is locked, Holdover with a growing sigma when it no longer
/// does. Batches that get no time are counted by reason and reported by a fault. Thread safety: one thread per object.
class SelfTimedLaser {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    LaserDiscipline::Config discipline{};
    nanoseconds holdover_limit{std::chrono::milliseconds(1)};  ///< sigma at which the crystal is given up
    int agreeing = 3;                                          ///< labels that must agree; [1, 1000]
    GpsTime not_before{};                                      ///< an earlier label is a rollover of the GPS week
    nanoseconds hold{std::chrono::seconds(30)};                ///< how long batches wait for labels, in arrivals
    std::size_t hold_returns = 4'000'000;                      ///< how many returns wait for labels; 32 bytes each
    /// A stamp that differs this much from the labels' time is a passing error.
    nanoseconds astray{std::chrono::seconds(5)};
  };
  explicit SelfTimedLaser(const Config& config)
      : config_(config), labels_(config.agreeing), discipline_(config.discipline) {}

  /// Adds a label. When the labels are settled, the batches held are stamped and appended to `out`.
  void add(const TimeLabel& label, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// Adds what the scanner reports about its clock.
  void add(const LaserStatus& status, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// Stamps or holds a batch, and appends to `out` in order of arrival. `leaps` is used only for GPS time minus UTC.
  void process(LaserBatch batch, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// Tells that the files have been read up to `now`. What has been held for too long is decided.
  void advance(HostTime now, const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  /// Ends the stream: what is held is judged by the labels that came.
  void flush(const HostClockModel& leaps, std::vector<StampedLaserBatch>& out);
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  SensorId sensor() const { return config_.sensor; }
  SyncState state() const { return state_; }
  /// Returns the time of the newest batch that was stamped.
  std::optional<GpsTime> newest() const { return newest_; }
  /// Returns true if batches wait for labels and may still be stamped.
  bool is_waiting() const { return !held_.empty(); }

  /// Counts of the laser returns that got no time, by reason.
  struct Counts {
    std::uint64_t never_locked = 0;  ///< the scanner never said that its clock is locked
    std::uint64_t lost_lock = 0;     ///< the reference was lost for longer than the crystal is good
    std::uint64_t no_label = 0;      ///< the clock was locked, but no valid label named the time
    std::uint64_t astray = 0;        ///< the stamp jumped away from the labels' time
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
  bool gave_up_ = false;  // gave up waiting for labels; nothing is held from now on
  bool was_locked_ = false, saw_rollover_ = false;
  std::optional<GpsTime> newest_;
  SyncState state_ = SyncState::Unlocked;
};

}  // namespace hueline::sync
