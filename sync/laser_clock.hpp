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

/// A scanner's stamps -> GPS time of the first firing, with the host's clock for a second witness.
///
/// A counter is taken to stand in the period that brings it nearest to the packet's arrival; one of its own origin
/// counts on from period to period, and its seconds are found by the check that follows. A scanner whose clock is
/// locked is believed below the second; its second is checked: arrival minus stamp must lie within [-early,
/// latency_max]. Batches that do not are held until `confirm` has passed; then a shift of exactly whole seconds is
/// corrected (fault LabelConflict), and any other, a half second above all, makes the scanner untrusted (fault
/// LabelConflict) until it has agreed with the host for twice as long. Batches that merely came late keep their stamp.
/// A scanner that lost its reference runs on its own crystal (Holdover, growing sigma); one that never had it, or lost
/// it too long ago, is stamped through the smallest latency of its packets (Acquiring, sigma of milliseconds, fault
/// NoTime). Reentrant.
class LaserClock {
 public:
  struct Config {
    SensorId sensor = kSystemSensor;
    LaserDiscipline::Config discipline{};
    nanoseconds early{std::chrono::milliseconds(5)};  ///< a packet may seem to come before its firing; [0, 100 ms]
    nanoseconds latency_max{std::chrono::milliseconds(100)};  ///< first firing to arrival; [1 ms, 400 ms]
    nanoseconds latency_min{
        std::chrono::microseconds(1500)};  ///< the same at its fastest (a packet spans 1.33 ms); >= 0
    nanoseconds latency_min_sigma{std::chrono::microseconds(500)};  ///< how well that is known; > 0
    nanoseconds confirm{std::chrono::seconds(1)};  ///< of disagreement before the stamp is judged; [100 ms, 10 s]
    std::size_t pending_limit = 8192;              ///< batches held meanwhile; [16, 1e6]
    std::size_t pending_returns = 4'000'000;       ///< of them, 32 bytes each; [1e4, 1e9]
    ArrivalLine::Config arrivals{};
    std::string validate() const;
  };
  explicit LaserClock(Config config) : config_(config), line_(config.arrivals), discipline_(config.discipline) {}

  void add(const LaserStatus& status);
  /// Stamps `batch`, or holds it. `host` can stamp. Appends to `out` in order of arrival.
  void process(LaserBatch batch, const HostClockModel& host, std::vector<StampedLaserBatch>& out);
  /// The end: judges what is held.
  void flush(std::vector<StampedLaserBatch>& out);
  void drain(std::vector<Fault>& out) { faults_.drain(out); }

  /// Earliest of what is held, for the watermark; empty if nothing is.
  std::optional<GpsTime> earliest_held() const;
  std::chrono::seconds correction() const { return correction_; }

  struct Counts {
    std::uint64_t batches = 0, disciplined = 0, corrected = 0, holdover = 0, by_arrival = 0, held = 0;
    std::uint64_t returns_without_clock = 0;  ///< the computer's clock had no relation to GPS
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Seen {
    LaserBatch batch;
    GpsStamp arrival;
    GpsTime nominal;       // by the stamp alone, uncorrected
    std::int64_t counter;  // the stamp, without the leaps of a counter from period to period
  };
  nanoseconds residual(const Seen& seen) const { return seen.arrival.time - (seen.nominal + correction_); }
  bool is_disciplined(HostTime at) const;
  bool fits(const Seen& seen) const;
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
  bool untrusted_ = false;              // the phase was seen to be wrong
  std::optional<HostTime> fits_since_;  // while untrusted
  bool host_doubtful_ = false;          // by the newest batch
  std::deque<Seen> pending_;
  std::size_t pending_returns_ = 0;
  std::optional<LaserTime> last_stamp_;
  std::int64_t periods_ns_ = 0;
  std::optional<GpsTime> last_time_;
};

}  // namespace hueline::sync
