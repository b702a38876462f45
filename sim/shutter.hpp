#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// When the exposures of the head happen. All lenses are strobed together. `factors` are those that automatic exposure
/// has chosen for the lenses (lens_gains()); they decide how long a lens is exposed if it sets the shutter, and an
/// exposure then lasts as long as the mean of its lenses. Times are GPS ns.
class Shutter {
 public:
  explicit Shutter(const Scenario& c)
      : first_(c.sensors_begin_gps_ns() + std::llround(c.camera.first_exposure_s * 1e9)),
        period_ns_(std::llround(1e9 / c.camera.rate_hz)),
        exposure_us_(c.camera.exposure_us),
        sets_shutter_(c.camera.auto_exposure && c.camera.auto_exposure_sets != CameraConfig::AutoSets::Gains),
        sets_each_(sets_shutter_ && c.camera.auto_exposure_sets == CameraConfig::AutoSets::Shutters),
        row_ns_(c.camera.shutter == ShutterKind::Rolling ? c.camera.row_time_us * 1000 : 0.0),
        middle_row_(0.5 * (c.camera.lens_height - 1)),
        late_from_(c.sensors_begin_gps_ns() + std::llround(c.camera.drift.at_s * 1e9)),
        late_ns_(std::llround(c.camera.drift.late_us * 1000)) {}

  /// Returns the time of the strobe's edge of exposure `number`.
  GpsNs start(std::size_t number) const { return first_ + static_cast<GpsNs>(number) * period_ns_; }
  /// Returns the true middle of exposure `number`, with its drift.
  GpsNs mid(std::size_t number, std::span<const float> factors) const {
    return true_start(number) + exposure_ns(factors) / 2;
  }
  /// Returns the true start of exposure `number`: that of the strobe, or later if the head has drifted.
  GpsNs true_start(std::size_t number) const { return start(number) + (start(number) < late_from_ ? 0 : late_ns_); }
  /// Returns how long a lens with this factor is exposed: an even number, so that the middle is a whole nanosecond.
  GpsNs exposure_ns(float factor) const {
    return 2 * std::llround(exposure_us_ * 500 * (sets_shutter_ ? static_cast<double>(factor) : 1.0));
  }
  GpsNs exposure_ns(std::span<const float> factors) const {
    if (!sets_each_ || factors.empty()) return exposure_ns(factors.empty() ? 1.0f : factors[0]);
    GpsNs sum = 0;
    for (const float factor : factors) sum += exposure_ns(factor);
    return sum / (2 * static_cast<GpsNs>(factors.size())) * 2;
  }
  /// Returns how much later than the middle of the exposure that of a lens is.
  GpsNs lateness(std::span<const float> factors, std::size_t lens) const {
    return sets_each_ ? (exposure_ns(factors[lens]) - exposure_ns(factors)) / 2 : 0;
  }
  /// Returns the amplification of a lens: its factor, without what its shutter makes of it.
  float amplification(float factor) const { return sets_shutter_ ? 1.0f : factor; }
  bool sets_shutter() const { return sets_shutter_; }
  bool is_rolling() const { return row_ns_ != 0; }
  /// Whether all pixels have the same middle.
  bool is_one_moment() const { return !is_rolling() && !sets_each_; }
  /// Returns how much later than the middle row of a lens image this row is exposed; the strobe belongs to the middle
  /// row. 0 with a global shutter.
  GpsNs row_delay(double row) const { return std::llround((row - middle_row_) * row_ns_); }

 private:
  GpsNs first_, period_ns_;
  double exposure_us_;
  bool sets_shutter_, sets_each_;
  double row_ns_, middle_row_;
  GpsNs late_from_, late_ns_;
};

}  // namespace hueline::sim
