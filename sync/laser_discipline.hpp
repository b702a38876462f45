#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/measurements.hpp"

namespace hueline::sync {

/// How good a scanner's own clock is. While the scanner says that its reference holds the clock, it is as good as the
/// reference. Afterwards it is as good as its crystal, with a sigma that grows until the clock is given up. Thread
/// safety: one thread per object.
class LaserDiscipline {
 public:
  struct Config {
    nanoseconds sigma{std::chrono::microseconds(2)};  ///< one sigma of a locked scanner's clock against GPS time; > 0
    double drift_ppm = 20;                            ///< one sigma of the crystal's drift; (0, 1000]
    std::chrono::seconds status_timeout{5};  ///< without a status for this long, the reference counts as lost; [1, 600]
    /// Returns an empty text if all values are allowed, otherwise a sentence that names the key and its range.
    std::string validate() const;
  };
  explicit LaserDiscipline(const Config& config) : config_(config) {}

  void add(LaserStatus status) { status_ = std::move(status); }
  bool has_status() const { return status_.has_value(); }
  /// Returns true if the newest status says that the clock is locked, however old the status is.
  bool claims_lock() const { return status_ && status_->clock == SyncState::Locked; }
  /// Returns true if the newest status says that the clock is locked, and is not too old for a packet received at `at`.
  bool is_locked(HostTime at) const { return claims_lock() && at - status_->received <= config_.status_timeout; }
  /// Returns true if the clock was locked at any time before.
  bool was_held() const { return last_held_.has_value(); }

  struct Trust {
    nanoseconds sigma;
    SyncState state;  ///< Locked or Holdover
  };
  /// Returns how far the stamp `time` can be trusted. `is_held` says whether the clock is locked now. If it is not,
  /// returns nothing in three cases: the crystal has drifted by more than `drift_limit` (one sigma) since the clock was
  /// locked; it was never locked; `time` lies before that.
  std::optional<Trust> trust(GpsTime time, bool is_held, nanoseconds drift_limit);

 private:
  Config config_;
  std::optional<LaserStatus> status_;
  std::optional<GpsTime> last_held_;
};

}  // namespace hueline::sync
