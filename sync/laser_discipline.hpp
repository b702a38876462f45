#pragma once

#include <optional>
#include <string>

#include "core/measurements.hpp"

namespace hueline::sync {

/// How good a scanner's own clock is: as good as its reference while the scanner says that it is held by one, and
/// afterwards as good as its crystal, whose sigma grows until it is given up. Reentrant.
class LaserDiscipline {
 public:
  struct Config {
    nanoseconds sigma{std::chrono::microseconds(2)};  ///< of a scanner held by its reference, against GPS; > 0
    double drift_ppm = 20;                            ///< of its crystal, one sigma; (0, 1000]
    std::chrono::seconds status_timeout{5};           ///< without a status the reference counts as lost; [1, 600]
    /// Empty if all is well, else a sentence naming the key and its range.
    std::string validate() const;
  };
  explicit LaserDiscipline(const Config& config) : config_(config) {}

  void add(LaserStatus status) { status_ = std::move(status); }
  bool has_status() const { return status_.has_value(); }
  /// The newest status says so, however old it is.
  bool claims_lock() const { return status_ && status_->clock == SyncState::Locked; }
  /// The same, and the status is not too old for what was received at `at`.
  bool is_locked(HostTime at) const { return claims_lock() && at - status_->received <= config_.status_timeout; }
  /// The clock was held at some time before.
  bool was_held() const { return last_held_.has_value(); }

  struct Trust {
    nanoseconds sigma;
    SyncState state;  ///< Locked or Holdover
  };
  /// Of what the clock stamped with `time`. `is_held`: it is held by its reference now. Empty if it is not, and the
  /// crystal has drifted by more than `drift_limit` (one sigma) since it was; or was never held; or `time` lies before.
  std::optional<Trust> trust(GpsTime time, bool is_held, nanoseconds drift_limit);

 private:
  Config config_;
  std::optional<LaserStatus> status_;
  std::optional<GpsTime> last_held_;
};

}  // namespace hueline::sync
