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

/// A host instant in GPS time.
struct GpsStamp {
  GpsTime time{};
  nanoseconds sigma{0};
  SyncState state = SyncState::Unlocked;
};

/// Host clock -> GPS time, from the edges of the pulse per second (phase and rate: ClockFilter) and from messages that
/// say which second they were (SecondLabel). Without pulses: from the smallest latency of timed messages, to
/// milliseconds.
///
/// States. Unlocked: no relation; nothing can be stamped. Acquiring: a relation exists but is not to be trusted (second
/// not settled or in conflict, sigma too large, or no pulses and only message arrivals). Locked: pulses fit, their
/// second is settled. Holdover: was locked, the pulses have stopped; sigma grows with the measured wander until
/// `holdover_limit`. Edges and arrivals that move together by the same time: the host's clock stepped, and everything
/// starts anew at once. Reentrant, synchronous; the only clock is the time carried by what it is told.
class HostClockModel {
 public:
  struct Config {
    SensorId pps = kSystemSensor;  ///< the sensor whose edges count; 0: there is none
    ClockFilter::Config filter;
    SecondLabel::Config label;
    nanoseconds edge_delay{0};  ///< mean latency of the edge's stamp, subtracted; [-1 ms, 10 ms]
    int acquire_edges = 5;      ///< edges of one phase to start with; [3, 16]
    int relock_edges = 3;       ///< fitting edges in a row that end Holdover; [1, 60]
    int reacquire_edges = 10;   ///< edges of a new phase, none of the old: the clock stepped; [4, 16]
    nanoseconds lock_sigma{std::chrono::microseconds(100)};       ///< Locked needs a smaller one; > 0
    nanoseconds holdover_after{std::chrono::milliseconds(2500)};  ///< without a fitting edge; [1.1 s, 60 s]
    nanoseconds holdover_limit{
        std::chrono::milliseconds(1)};       ///< sigma at which the relation is given up; > lock_sigma
    std::chrono::seconds relabel_after{10};  ///< settled contradiction this long changes the label; [1, 600]
    /// Without pulses (none configured, or none usable for `pps_patience`): GPS time is arrival less the smallest
    /// latency.
    std::chrono::seconds pps_patience{30};                      ///< [1, 3600]
    nanoseconds arrival_latency{std::chrono::milliseconds(3)};  ///< expected smallest latency of a timed message; >= 0
    nanoseconds arrival_latency_sigma{std::chrono::milliseconds(3)};  ///< and how well that is known; > 0
    ArrivalLine::Config arrivals;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit HostClockModel(Config config);

  void add(const PpsEdge& edge);
  void add(const TimeLabel& label);
  /// What `label` says of leap seconds alone; the other add() does this too.
  void add_utc_offset(const TimeLabel& label);
  /// Any message that names the GPS time of something past and came at `received`.
  void add(const TimedArrival& arrival);
  /// Stream time passes; called with every packet's `received`. Never goes back.
  void advance(HostTime now);

  SyncState state() const { return state_; }
  /// Empty while Unlocked, and while the second is not settled.
  std::optional<GpsStamp> stamp(HostTime t) const;
  /// True if stamp() gives times to use: Locked, Holdover, or the settled relation from arrivals where pulses are
  /// missing.
  bool can_stamp() const;
  /// Why can_stamp() is false: a clause for people. One of a few texts; empty if it is true.
  const char* why_not() const;
  bool is_from_arrivals() const { return fallback_; }
  /// A fitting edge of the last second holds the relation; else it is extrapolated.
  bool has_fresh_pulse() const {
    return filter_.is_started() && now_ - filter_.last_edge() <= std::chrono::milliseconds(1200);
  }
  /// True if the relation may be off by more than sigma: no fresh pulse, or messages that all come at another latency
  /// than when the last edge fitted.
  bool is_doubtful() const { return !has_fresh_pulse() || std::abs(arrivals_moved_s()) > 0.05; }
  /// GPS - UTC: the receiver's, if it is possible by the table of leap seconds; else the table's.
  std::chrono::seconds utc_offset(GpsTime t) const;
  double rate() const { return filter_.is_started() ? filter_.rate() : 0; }
  const Instability& instability() const { return filter_.instability(); }

  struct Counts {
    std::uint64_t edges = 0, accepted = 0, refused = 0, doubled = 0, missing = 0, labels = 0, invalid_labels = 0,
                  arrivals = 0;
    std::uint64_t restarts = 0, relabels = 0, holdovers = 0;
  };
  const Counts& counts() const { return counts_; }
  /// Faults noticed since the last call.
  void drain(std::vector<Fault>& out) { faults_.drain(out); }
  void flush() { faults_.flush(); }

 private:
  void start(const std::vector<HostTime>& edges);
  void restart(HostTime now, const std::string& why);
  void watch_arrival(const TimedArrival& arrival);
  double arrivals_moved_s() const;
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
  std::uint64_t told_missing_ = 0;  // edges since the last good one
  std::optional<SensorId> line_source_;
  std::deque<double> recent_delays_s_;   // of the newest messages, by this clock
  std::optional<double> usual_delay_s_;  // the least of them when the last edge fitted
  std::optional<std::chrono::seconds> reported_utc_offset_;
  HostTime next_judgement_{};
};

}  // namespace hueline::sync
