#pragma once

#include <cmath>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// When the exposures of the head happen. All lenses are strobed together. Times are GPS ns.
class Shutter {
 public:
  explicit Shutter(const Scenario& c)
      : first_(c.sensors_begin_gps_ns() + std::llround(c.camera.first_exposure_s * 1e9)),
        period_ns_(std::llround(1e9 / c.camera.rate_hz)),
        exposure_ns_(2 * std::llround(c.camera.exposure_us * 500)),  // even, so that its middle is a whole nanosecond
        row_ns_(c.camera.shutter == ShutterKind::Rolling ? c.camera.row_time_us * 1000 : 0.0),
        middle_row_(0.5 * (c.camera.lens_height - 1)),
        late_from_(c.sensors_begin_gps_ns() + std::llround(c.camera.drift.at_s * 1e9)),
        late_ns_(std::llround(c.camera.drift.late_us * 1000)) {}

  /// Returns the time of the strobe's edge of exposure `number`.
  GpsNs start(std::size_t number) const { return first_ + static_cast<GpsNs>(number) * period_ns_; }
  /// Returns the true middle of exposure `number`, with its drift.
  GpsNs mid(std::size_t number) const { return true_start(number) + exposure_ns_ / 2; }
  /// Returns the true start of exposure `number`: that of the strobe, or later if the head has drifted.
  GpsNs true_start(std::size_t number) const { return start(number) + (start(number) < late_from_ ? 0 : late_ns_); }
  GpsNs exposure_ns() const { return exposure_ns_; }
  bool is_rolling() const { return row_ns_ != 0; }
  /// Returns how much later than the middle row of a lens image this row is exposed; the strobe belongs to the middle
  /// row. 0 with a global shutter.
  GpsNs row_delay(double row) const { return std::llround((row - middle_row_) * row_ns_); }

 private:
  GpsNs first_, period_ns_, exposure_ns_;
  double row_ns_, middle_row_;
  GpsNs late_from_, late_ns_;
};

}  // namespace hueline::sim
