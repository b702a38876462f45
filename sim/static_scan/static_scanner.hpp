#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/static_scan/site.hpp"

namespace hueline::sim {

/// A terrestrial laser scanner of the VZ-1000's class, with one return a beam and noise of range and angles.
struct StaticScannerConfig {
  double step_deg = 0.08;  ///< angle between beams, both ways, over the whole panorama
  double lowest_deg = -45, highest_deg = 22;
  /// Step with which the scan is repeated around each sphere and at as many other places, as operators do; 0: no
  /// repetition.
  double window_step_deg = 0.0135;
  double window_half_deg = 0.5;
  double range_precision_m = 0.005;
  double angle_sigma_rad = 17.5e-6;
  double reach_m = 600;
};

/// What truly hit a sphere, and how well the hits determine its centre.
struct SphereTruth {
  std::uint64_t hits = 0;
  /// Fisher information of the centre from the range and angle noise of the hits, in the site's axes, row-major, 1/m^2.
  std::array<double, 9> information{};
};

/// The scan of one station, column by column. A column depends on nothing but its number. Keeps a reference to `site`.
class StaticScan {
 public:
  StaticScan(const StaticSite& site, const StaticScannerConfig& config);
  std::uint32_t columns() const { return column_count_; }
  /// Appends the points of a column to `xyz` (x y z in the scanner's frame, m) and adds its hits to `truth`, which has
  /// one entry for each sphere. Thread-safe.
  void cast(std::uint32_t column, std::vector<float>& xyz, std::vector<SphereTruth>& truth) const;

 private:
  struct Patch {
    double azimuth, elevation, step;  // of the first beam
    std::uint32_t columns, rows, first_column;
  };
  struct Hit {
    double distance;
    int sphere;
  };
  struct Column;
  void prepare(double azimuth, Column& column) const;
  Hit nearest(const Column& column, double cos_elevation, double sin_elevation, std::size_t& ground_at,
              std::uint64_t random) const;

  const StaticSite& site_;
  StaticScannerConfig config_;
  std::vector<Patch> patches_;
  std::uint32_t column_count_ = 0;
};

/// Writes the whole scan as float32 x y z, the columns in order, cast on several threads. Stops after `most_points`.
/// Adds the hits to `truth` and returns the number of points.
Result<std::uint64_t> write_static_scan(const StaticScan& scan, const std::string& path, std::uint64_t most_points,
                                        unsigned threads, std::vector<SphereTruth>& truth);

/// Returns the step that gives about `points` points over the whole panorama of a site, without the windows.
double step_for_points(const StaticSite& site, const StaticScannerConfig& config, std::uint64_t points);

}  // namespace hueline::sim
