#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "sync/arrival_line.hpp"
#include "sync/clock_filter.hpp"
#include "sync/fault_log.hpp"
#include "sync/pulse_finder.hpp"
#include "sync/second_label.hpp"

namespace hueline::sync {

/// A host time converted to GPS time.
struct GpsStamp {
  GpsTime time{};
  nanoseconds sigma{0};
  SyncState state = SyncState::Unlocked;
};

/// Converts the host clock to GPS time.
///
/// Phase and rate come from the edges of the pulse per second (ClockFilter). Which second a pulse is comes from
/// messages (SecondLabel). Without pulses, the smallest latency of timed messages gives GPS time to milliseconds
/// (ArrivalLine).
///
///   state      meaning
///   Unlocked   There is no relation, and nothing can be stamped.
///   Acquiring  A relation exists, but it cannot be trusted: the second is not settled or in conflict, sigma is too
///              large, or there are only arrivals of messages and no pulses.
///   Locked     The pulses fit, and their second is settled.
///   Holdover   The clock was locked, but the pulses have stopped. Sigma grows with the measured wander until
///              `holdover_limit`.
///
/// If edges and arrivals move together by the same time, then the host's clock has stepped, and everything starts again
/// at once. The model reads no clock: its only time is that of its input. Thread safety: one thread per object.
class HostClockModel {
 public:
  struct Config {
    SensorId pps = kSystemSensor;  ///< the sensor whose edges are used; 0: there is none
    ClockFilter::Config filter;
    SecondLabel::Config label;
    nanoseconds edge_delay{0};  ///< mean latency of an edge's stamp; it is subtracted; [-1 ms, 10 ms]
    int acquire_edges = 5;      ///< edges of one phase that are needed to start; [3, 16]
    int relock_edges = 3;       ///< consecutive fitting edges that end Holdover; [1, 60]
    /// Edges of a new phase, with none of the old one, that prove a step of the clock; [4, 16].
    int reacquire_edges = 10;
    nanoseconds lock_sigma{std::chrono::microseconds(100)};  ///< Locked needs a smaller sigma; > 0
    /// Holdover begins after this time without a fitting edge; [1.1 s, 60 s].
    nanoseconds holdover_after{std::chrono::milliseconds(2500)};
    /// Sigma at which Holdover is given up; above lock_sigma and at most 50 ms.
    nanoseconds holdover_limit{std::chrono::milliseconds(1)};
    /// A settled contradiction that lasts this long changes the label; [1, 600].
    std::chrono::seconds relabel_after{10};
    /// If there are no usable pulses for this long, or no PPS sensor at all, GPS time is the arrival minus the smallest
    /// latency; [1, 3600].
    std::chrono::seconds pps_patience{30};
    nanoseconds arrival_latency{std::chrono::milliseconds(3)};  ///< expected smallest latency of a timed message; >= 0
    nanoseconds arrival_latency_sigma{std::chrono::milliseconds(3)};  ///< one sigma of arrival_latency; > 0
    ArrivalLine::Config arrivals;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit HostClockModel(Config config);

  /// Adds an edge. Edges of other sensors than Config::pps are ignored.
  void add(const PpsEdge& edge);
  /// Adds a label. A label that is not valid is counted, but not used.
  void add(const TimeLabel& label);
  /// Takes over only what `label` says about leap seconds. add() of a label does this too.
  void add_utc_offset(const TimeLabel& label);
  /// Adds a message that names the GPS time of a past event and arrived at `received`.
  void add(const TimedArrival& arrival);
  /// Tells that time has passed. Call it with `received` of every packet. An earlier time than before has no effect.
  void advance(HostTime now);

  SyncState state() const { return state_; }
  /// Returns the GPS time of `t`. Empty while Unlocked, and while the second is not settled.
  std::optional<GpsStamp> stamp(HostTime t) const;
  /// Returns true if the times of stamp() can be used: in Locked, in Holdover, and, if pulses are missing, with a
  /// settled relation from arrivals.
  bool can_stamp() const;
  /// Returns why can_stamp() is false, as a clause for people. It is one of a few fixed texts; empty if can_stamp() is
  /// true.
  const char* why_not() const;
  /// Whether the sources disagree about the second of the pulses, with each other or with the label in use.
  bool is_disputed() const { return disputed_ || contradicted_; }
  /// Returns true if the times come from arrivals, because pulses are missing.
  bool is_from_arrivals() const { return fallback_; }
  /// Returns true if an edge that fits came within the last 1.2 s; otherwise the relation is extrapolated.
  bool has_fresh_pulse() const {
    return filter_.is_started() && now_ - filter_.last_edge() <= std::chrono::milliseconds(1200);
  }
  /// Returns true if the error may exceed sigma: there is no fresh pulse, or the latencies of all messages have changed
  /// since the last edge that fitted.
  bool is_doubtful() const { return !has_fresh_pulse() || std::abs(arrivals_moved_s()) > 0.05; }
  /// Returns GPS time minus UTC: the receiver's value if the table of leap seconds allows it, otherwise that of the
  /// table.
  std::chrono::seconds utc_offset(GpsTime t) const;
  /// Returns pulse seconds (GPS seconds) per host second, minus 1; 0 without pulses.
  double rate() const { return filter_.is_started() ? filter_.rate() : 0; }
  const Instability& instability() const { return filter_.instability(); }

  struct Counts {
    std::uint64_t edges = 0, accepted = 0, refused = 0, doubled = 0, missing = 0, labels = 0, invalid_labels = 0,
                  arrivals = 0;
    std::uint64_t restarts = 0, relabels = 0, holdovers = 0;
  };
  const Counts& counts() const { return counts_; }
  /// Appends the faults since the last call to `out`.
  void drain(std::vector<Fault>& out) { faults_.drain(out); }
  void flush() { faults_.flush(); }

 private:
  void start(const std::vector<HostTime>& edges);
  void restart(HostTime now, const std::string& why);
  void watch_arrival(const TimedArrival& arrival);
  double arrivals_moved_s() const;
  /// Returns true if one edge says less about the time than Locked asks for: many are needed then.
  bool has_scattered_pulses() const;
  void judge_label();
  void judge_state();
  void enter_fallback();
  void compare_with_arrivals(SensorId sensor, GpsTime time, HostTime received);
  std::optional<GpsStamp> stamp_from_arrivals(HostTime t) const;

  Config config_;
  ClockFilter filter_;
  PulseFinder finder_;
  SecondLabel label_;
  ArrivalLine line_;
  FaultLog faults_;
  Counts counts_;
  SyncState state_ = SyncState::Unlocked;
  HostTime now_{};
  bool began_ = false, fallback_ = false;
  HostTime begin_{}, usable_{}, contradicted_since_{}, disputed_until_{};
  std::optional<std::int64_t> N_;
  bool contradicted_ = false, disputed_ = false;
  std::int64_t last_pulse_ = 0;
  int in_a_row_ = 0;
  std::optional<std::uint64_t> last_sequence_;
  std::uint64_t told_missing_ = 0;  // edges that the source counted but did not deliver, since the last good one
  std::optional<SensorId> line_source_;
  std::deque<double> recent_delays_s_;   // delays of the newest messages, by this clock
  std::optional<double> usual_delay_s_;  // the smallest of them when the last edge fitted
  std::optional<std::chrono::seconds> reported_utc_offset_;
  HostTime next_judgement_{};
};

}  // namespace hueline::sync
