#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/stamped.hpp"
#include "sync/arrival_line.hpp"
#include "sync/fault_log.hpp"
#include "sync/host_clock_model.hpp"
#include "sync/laser_discipline.hpp"

namespace hueline::sync {

/// Converts a scanner's stamps to the GPS time of the first firing, and checks them against the host's clock.
///
/// - A counter is assumed to be in the period that brings it nearest to the packet's arrival. A counter of its own
///   origin continues from period to period; the check below finds its seconds.
/// - A scanner whose clock is locked is trusted below the second. Its second is checked: arrival minus stamp must lie
///   in [-early, latency_max].
/// - Batches that fail the check are held until `confirm` has passed. Then a shift by exactly whole seconds is
///   corrected (fault LabelConflict). Any other shift, above all by half a second, makes the scanner untrusted (fault
///   LabelConflict) until it has agreed with the host, but for whole seconds, for twice as long. Batches that were only
///   delivered late keep their stamp.
/// - A scanner that has lost its reference is stamped by its own crystal (Holdover, growing sigma).
/// - A scanner that never had a reference, or lost it too long ago, is stamped by the smallest latency of its packets
///   (Acquiring, sigma of milliseconds, fault NoTime).
///
/// Thread safety: one thread per object.
class LaserClock {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    LaserDiscipline::Config discipline{};
    /// How much a packet may seem to arrive before its firing; [0, 100 ms].
    nanoseconds early{std::chrono::milliseconds(5)};
    /// Largest time from the first firing to the arrival; [1 ms, 400 ms].
    nanoseconds latency_max{std::chrono::milliseconds(100)};
    /// Smallest time from the first firing to the arrival (a packet spans 1.33 ms); [0, latency_max].
    nanoseconds latency_min{std::chrono::microseconds(1500)};
    nanoseconds latency_min_sigma{std::chrono::microseconds(500)};  ///< one sigma of latency_min; > 0
    /// How long a disagreement must last before the stamp is judged; [100 ms, 10 s].
    nanoseconds confirm{std::chrono::seconds(1)};
    std::size_t pending_limit = 8192;         ///< batches held during that time, at most; [16, 1e6]
    std::size_t pending_returns = 4'000'000;  ///< returns held during that time, 32 bytes each, at most; [1e4, 1e9]
    ArrivalLine::Config arrivals{};
    std::string validate() const;
  };
  explicit LaserClock(Config config) : config_(config), line_(config.arrivals), discipline_(config.discipline) {}

  /// Adds what the scanner reports about its clock.
  void add(const LaserStatus& status);
  /// Stamps `batch`, or holds it. Requires host.can_stamp(). Appends to `out` in order of arrival.
  void process(LaserBatch batch, const HostClockModel& host, std::vector<StampedLaserBatch>& out);
  /// Ends the stream: judges what is held.
  void flush(std::vector<StampedLaserBatch>& out);
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  /// Returns the earliest time of what is held, for the watermark; empty if nothing is held.
  std::optional<GpsTime> earliest_held() const;
  /// Returns the whole seconds that are added to the scanner's stamps.
  std::chrono::seconds correction() const { return correction_; }

  struct Counts {
    std::uint64_t batches = 0, disciplined = 0, corrected = 0, holdover = 0, by_arrival = 0, held = 0;
    /// Returns without a time, because the host's clock had no relation to GPS time.
    std::uint64_t returns_without_clock = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Seen {
    LaserBatch batch;
    GpsStamp arrival;
    GpsTime nominal;       // the time by the stamp alone, not corrected
    std::int64_t counter;  // the stamp, continued over the periods of the counter
  };
  nanoseconds residual(const Seen& seen) const { return seen.arrival.time - (seen.nominal + correction_); }
  bool is_disciplined(HostTime at) const;
  /// An untrusted scanner that has agreed with the host, but for whole seconds.
  struct Agreement {
    HostTime received;  // of its first batch
    std::chrono::seconds behind;
  };
  bool fits(const Seen& seen) const;
  std::optional<std::chrono::seconds> seconds_behind(const Seen& seen) const;
  void judge_anew(const Seen& seen);
  std::int64_t unwrap(const LaserTime& time);
  void judge(std::vector<StampedLaserBatch>& out);
  void emit(Seen&& seen, std::vector<StampedLaserBatch>& out);
  void emit_by_arrival(Seen&& seen, bool by_line, std::vector<StampedLaserBatch>& out);

  Config config_;
  ArrivalLine line_;
  FaultLog faults_;
  Counts counts_;
  LaserDiscipline discipline_;
  std::chrono::seconds correction_{0};
  bool untrusted_ = false;  // the phase was found to be wrong
  std::optional<Agreement> agrees_since_;
  bool host_doubtful_ = false;  // is_doubtful() at the newest batch
  std::deque<Seen> pending_;
  std::size_t pending_returns_ = 0;
  std::optional<LaserTime> last_stamp_;
  std::int64_t periods_ns_ = 0;
  std::optional<GpsTime> last_time_;
};

}  // namespace hueline::sync
