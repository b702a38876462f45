#include "sync/laser_discipline.hpp"

#include <algorithm>
#include <cmath>

#include "core/portable_math.hpp"

namespace hueline::sync {

std::string LaserDiscipline::Config::validate() const {
  using std::chrono::seconds;
  if (sigma <= nanoseconds(0)) return "sigma must be positive";
  if (!(drift_ppm > 0 && drift_ppm <= 1000)) return "drift_ppm must be above 0 and at most 1000";
  if (status_timeout < seconds(1) || status_timeout > seconds(600)) return "status_timeout must be 1 to 600 s";
  return {};
}

std::optional<LaserDiscipline::Trust> LaserDiscipline::trust(GpsTime time, bool is_held, nanoseconds drift_limit) {
  if (is_held) {
    last_held_ = last_held_ ? std::max(*last_held_, time) : time;
    return Trust{config_.sigma, SyncState::Locked};
  }
  if (!last_held_) return {};
  const double drift = static_cast<double>((time - *last_held_).count()) * config_.drift_ppm * 1e-6;
  if (drift < 0 || drift > static_cast<double>(drift_limit.count())) return {};
  const double sigma = portable::hypot(static_cast<double>(config_.sigma.count()), drift);
  return Trust{nanoseconds(static_cast<std::int64_t>(std::ceil(sigma))), SyncState::Holdover};
}

}  // namespace hueline::sync
