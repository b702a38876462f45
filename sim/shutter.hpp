#pragma once

#include <cmath>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// When the head's exposures happen. All lenses are strobed together.
class Shutter {
 public:
  explicit Shutter(const Scenario& c)
      : first_(c.sensors_begin_gps_ns() + std::llround(c.camera.first_exposure_s * 1e9)),
        period_ns_(std::llround(1e9 / c.camera.rate_hz)),
        exposure_ns_(2 * std::llround(c.camera.exposure_us * 500)),  // even: its middle is a whole nanosecond
        row_ns_(c.camera.shutter == ShutterKind::Rolling ? c.camera.row_time_us * 1000 : 0.0),
        middle_row_(0.5 * (c.camera.lens_height - 1)) {}

  /// The strobe's edge.
  GpsNs start(std::size_t number) const { return first_ + static_cast<GpsNs>(number) * period_ns_; }
  GpsNs mid(std::size_t number) const { return start(number) + exposure_ns_ / 2; }
  GpsNs exposure_ns() const { return exposure_ns_; }
  bool is_rolling() const { return row_ns_ != 0; }
  /// A row of a lens image is exposed by this much later than the middle one; the strobe belongs to the middle row. 0
  /// with a global shutter.
  GpsNs row_delay(double row) const { return std::llround((row - middle_row_) * row_ns_); }

 private:
  GpsNs first_, period_ns_, exposure_ns_;
  double row_ns_, middle_row_;
};

}  // namespace hueline::sim
