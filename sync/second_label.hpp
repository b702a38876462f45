#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/fault.hpp"
#include "core/time.hpp"

namespace hueline::sync {

/// Which GPS second a pulse was: GPS seconds = pulse seconds + N, with one integer N for the whole chain of pulses.
///
/// Evidence is one-sided. A message that names a past instant t and arrives at pulse time p proves N >= t - p, and N =
/// ceil(t - p) if it came less than a second late. So of one source the largest N that `agreeing` messages support is
/// its verdict; single messages prove nothing, and labels that are late by more than a second merely support a smaller
/// N.
///
/// Rule, in this order:
/// 1. Arrivals of frequent messages whose smallest latency is below `decisive_latency` settle their source's N. Labels
/// of the
///    same or another source that say up to `late_seconds` less are late, not wrong.
/// 2. Labels alone settle it after `agreeing_alone` of them, if `allow_labels_alone`; whether a source is late by more
/// than a second
///    each and every time cannot be told from labels alone.
/// 3. Sources that differ otherwise are a conflict (18 s: UTC for GPS; 37 s or 19 s: TAI; 1024 weeks: rollover; 1 s:
/// label off by
///    one). `trusted` decides if it is set and has a verdict; otherwise nobody does and N is unknown.
/// 4. An N before `not_before` is a week rollover: never a verdict.
class SecondLabel {
 public:
  struct Config {
    int agreeing = 3;        ///< messages that must support an N; [1, 1000]
    int agreeing_alone = 5;  ///< the same where only labels are known; [1, 1000]
    bool allow_labels_alone = true;
    std::chrono::seconds window{60};                               ///< how long evidence counts; [10, 3600]
    nanoseconds early_tolerance{std::chrono::milliseconds(5)};     ///< an arrival may seem this early; [0, 100 ms]
    nanoseconds decisive_latency{std::chrono::milliseconds(400)};  ///< [1 ms, 900 ms]
    int late_seconds = 3;                                          ///< largest believable lateness of a label; [1, 10]
    SensorId trusted = kSystemSensor;                              ///< 0: none
    GpsTime not_before{
        std::chrono::seconds(1'009'411'215)};  ///< 2012-01-01T00:00:00 UTC; catches a rollover until 2031
    std::string validate() const;
  };
  enum class Evidence : std::uint8_t { Label, Arrival };

  explicit SecondLabel(Config config) : config_(config) {}

  /// A message of `sensor` that names `time` came at `received`, which is `pulse_ns` on the pulse axis.
  void add(SensorId sensor, Evidence kind, GpsTime time, HostTime received, std::int64_t pulse_ns);

  struct Conflict {
    SensorId sensor{};
    std::int64_t seconds = 0;  ///< what it says minus what was decided (or minus the other source, if nothing was)
    std::string detail;
  };
  struct Decision {
    std::optional<std::int64_t> N;
    bool from_arrivals = false;  ///< settled by latency, not by labels alone
    bool disputed = false;       ///< sources differ and none is trusted: N is empty, and an N known before is in doubt
    std::vector<Conflict> conflicts;
  };
  Decision decide(HostTime now) const;

  /// The pulse axis was restarted: all evidence is void.
  void reset() { sources_.clear(); }
  std::uint64_t evidence() const { return evidence_; }

 private:
  struct Candidate {
    std::int64_t N = 0;
    std::uint64_t older = 0, newer = 0;  // support in the last and the running half window
    std::int64_t min_latency_ns = 0;
    HostTime seen{};
  };
  struct Source {
    SensorId sensor{};
    Evidence kind{};
    HostTime half_began{};
    std::vector<Candidate> candidates;  // at most 16
  };
  struct Verdict {
    SensorId sensor{};
    std::optional<std::int64_t> labels, arrivals;
    bool decisive = false;
    std::uint64_t label_support = 0;
  };
  const Candidate* settled(const Source& source, HostTime now) const;
  std::string explain(SensorId sensor, std::int64_t difference) const;

  Config config_;
  std::vector<Source> sources_;  // by sensor and kind, in order of appearance
  std::uint64_t evidence_ = 0;
};

/// What a wrong whole-second offset usually is, for people: "18 s: UTC taken for GPS time".
std::string describe_offset(std::int64_t seconds);

}  // namespace hueline::sync
