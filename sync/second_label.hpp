#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/fault.hpp"
#include "core/time.hpp"

namespace hueline::sync {

/// Finds out which GPS second a pulse is: GPS seconds = pulse seconds + N, with one integer N for all pulses.
///
/// Evidence is one-sided. A message that names a past instant t and arrives at pulse time p proves N >= t - p. If it
/// arrived less than a second after t, then N = ceil(t - p). A single message proves nothing, because its time may be
/// wrong. So the verdict of a source is the largest N that at least `agreeing` of its messages support. A label that is
/// more than a second late supports a smaller N.
///
/// The rules, in this order:
/// 1. Arrivals of frequent messages settle the N of their source, if their smallest latency is below
///    `decisive_latency`. Labels of any source whose N is smaller by at most `late_seconds` are late, not wrong.
/// 2. If a source has no such arrivals, its labels alone settle its N, after `agreeing_alone` labels and if
///    `allow_labels_alone` is set. Labels alone cannot show whether a source is always more than a second late.
/// 3. All other differences between sources are a conflict. If `trusted` is set and has a verdict, it decides.
///    Otherwise N is unknown.
/// 4. An N that leads to a time before `not_before` is a rollover of the GPS week number. It is never a verdict.
///
/// Usual differences (describe_offset() names them):
///
///   difference    cause
///   1 s           a label that is off by one second
///   17 or 18 s    UTC taken for GPS time, or the reverse
///   19 s          TAI taken for GPS time
///   36 or 37 s    TAI taken for UTC
///   1024 weeks    rollover of the week number
///   whole weeks   wrong week
///   whole hours   local time taken for UTC
///
/// The pulse axis is that of ClockFilter. Thread safety: one thread per object.
class SecondLabel {
 public:
  struct Config {
    int agreeing = 3;        ///< how many messages must support an N; [1, 1000]
    int agreeing_alone = 5;  ///< how many labels must support an N if only labels are known; [1, 1000]
    bool allow_labels_alone = true;
    std::chrono::seconds window{60};                            ///< how long evidence counts; [10, 3600]
    nanoseconds early_tolerance{std::chrono::milliseconds(5)};  ///< how early an arrival may seem to be; [0, 100 ms]
    /// Smallest latency below which arrivals are decisive; [1 ms, 900 ms].
    nanoseconds decisive_latency{std::chrono::milliseconds(400)};
    int late_seconds = 3;              ///< largest believable lateness of a label; [1, 10]
    SensorId trusted = kSystemSensor;  ///< the source that decides conflicts; 0: none
    /// 2012-01-01T00:00:00 UTC; this detects a week rollover until 2031.
    GpsTime not_before{std::chrono::seconds(1'009'411'215)};
    std::string validate() const;
  };
  /// Label: a TimeLabel. Arrival: a TimedArrival.
  enum class Evidence : std::uint8_t { Label, Arrival };

  explicit SecondLabel(Config config) : config_(config) {}

  /// Adds the evidence of one message of `sensor`. It names `time`, and it arrived at `received`, which is `pulse_ns`
  /// on the pulse axis.
  void add(SensorId sensor, Evidence kind, GpsTime time, HostTime received, std::int64_t pulse_ns);

  /// A source whose N differs.
  struct Conflict {
    SensorId sensor{};
    /// Its N minus the decided N, or minus the other source's N if nothing was decided.
    std::int64_t seconds = 0;
    std::string detail;
  };
  /// What the evidence says.
  struct Decision {
    std::optional<std::int64_t> N;
    bool from_arrivals = false;  ///< decided by arrivals, not by labels alone
    /// Sources differ and none is trusted. N is empty, and an N that was known before is in doubt.
    bool disputed = false;
    std::vector<Conflict> conflicts;
  };
  /// Applies the rules to the evidence of the last Config::window before `now`.
  Decision decide(HostTime now) const;

  /// Forgets all evidence. Call it when the pulse axis starts again.
  void reset() { sources_.clear(); }
  std::uint64_t evidence() const { return evidence_; }

 private:
  struct Candidate {
    std::int64_t N = 0;
    std::uint64_t older = 0, newer = 0;  // messages that support it, in the last and in the current half of the window
    std::int64_t min_latency_ns = 0;
    HostTime seen{};
  };
  struct Source {
    SensorId sensor{};
    Evidence kind{};
    HostTime half_began{};
    std::vector<Candidate> candidates;  // at most 16
  };
  /// What the evidence of one sensor says.
  struct Verdict {
    SensorId sensor{};
    std::optional<std::int64_t> labels, arrivals;
    bool decisive = false;
    std::uint64_t label_support = 0;
  };
  /// The N of one sensor.
  struct Opinion {
    SensorId sensor{};
    std::int64_t N = 0;
    bool decisive = false;
  };
  const Candidate* settled(const Source& source, HostTime now) const;
  /// Returns a verdict for each sensor with settled evidence. Times before any possible drive are conflicts.
  std::vector<Verdict> verdicts(HostTime now, std::vector<Conflict>& conflicts) const;
  /// Returns the N of each sensor that has one. A sensor that contradicts itself has none, unless it is trusted.
  std::vector<Opinion> opinions(HostTime now, std::vector<Conflict>& conflicts) const;
  std::string explain(SensorId sensor, std::int64_t difference) const;

  Config config_;
  std::vector<Source> sources_;  // by sensor and kind, in order of appearance
  std::uint64_t evidence_ = 0;
};

/// Describes a whole-second offset for people, with its usual cause: "18 s (UTC taken for GPS time, or the reverse)".
std::string describe_offset(std::int64_t seconds);

}  // namespace hueline::sync
