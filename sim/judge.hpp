#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/truth_file.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// A coloured point as the program under test claims it.
struct Claim {
  GpsNs fired_gps_ns = 0;      ///< its firing; a microsecond off is fine
  std::uint16_t channel = 0;   ///< ring from the lowest elevation
  std::uint32_t exposure = 0;  ///< number of the exposure that gave the colour, as the simulated camera counts from 0
  std::uint8_t lens = 0;
  bool is_panorama_pixel = false;  ///< u, v: of the panorama; else of the lens image
  double u = 0, v = 0;             ///< pixel that gave the colour; centres at whole numbers
  std::uint8_t red = 0, green = 0, blue = 0;
  std::optional<Vec3> place_ecef;  ///< where the program puts the point, m
};

struct Verdict {
  TruePixel expected;  ///< where the true point is in the true image
  double error_px =
      0;  ///< angle between claimed and true pixel's rays, in pixels of the panorama (width / 2 pi a radian)
  double colour_difference = 0;  ///< largest of the three channels against TrueReturn's colour, 0 .. 255
  double place_error_m = 0;      ///< against TrueReturn's beam; 0 without a claimed place
  double distance_m = 0;         ///< of the true point from the head, at the exposure
  std::uint16_t surface = 0;
};

/// Distribution of one figure: exact mean square and maximum, quantiles to 1 %.
class Spread {
 public:
  void add(double x);
  std::uint64_t count() const { return count_; }
  double rms() const;
  double max() const { return max_; }
  /// Smallest value that `share` of the values do not exceed.
  double quantile(double share) const;

 private:
  static constexpr std::size_t kBins = 2400;  // 1e-6 .. 1e5 in steps of about 1 %
  std::uint64_t count_ = 0;
  double sum_square_ = 0, max_ = 0;
  std::vector<std::uint64_t> bins_;
};

/// Compares coloured points with a drive's truth by the simulator's own projection: the true point (scanner's true
/// place + true beam x the range on the wire) seen from the true pose at the exposure's true middle. Shares no code
/// with fusion/. Judging is thread-safe, accumulating is not.
class Judge {
 public:
  struct Config {
    double panorama_width = 8000, panorama_height = 4000;
    double forward_column = 3999.5;  ///< column of the head's +x direction
    bool is_clockwise = true;        ///< columns grow clockwise seen from above
    std::int64_t match_ns = 20'000;  ///< a claim farther from every firing of its channel is unmatched; of a profile
                                     ///< scanner no more than 0.4 of the time between pulses
    std::string validate() const;
  };
  /// Reads the truth whole (72 bytes a return). Errors: Io, Malformed, Invalid.
  static Result<Judge> open(const Scenario& scenario, const std::string& truth_file, const Config& config);

  /// Empty: no such firing, exposure or lens, or the true point is beyond the lens's field of view.
  std::optional<Verdict> judge(const Claim& claim) const;
  /// Truth of the firing that a claim means, found as judge() finds it; empty without one.
  std::optional<TrueReturn> true_return(std::uint16_t channel, GpsNs fired) const;
  /// Pixel of a direction in the head's frame on the panorama, and back (unit length).
  TruePixel panorama_pixel(Vec3 direction_head) const;
  Vec3 panorama_direction(TruePixel pixel) const;

  struct Figures {
    Spread error_px, colour_difference, place_error_m;
  };
  /// Judges and adds to the figures.
  void add(const Claim& claim);
  const Figures& all() const { return all_; }
  const std::vector<Figures>& by_lens() const { return by_lens_; }
  /// Claims that could not be judged; never part of the figures, so to be shown beside them.
  std::uint64_t unmatched() const { return unmatched_; }
  std::uint64_t true_returns() const { return true_returns_; }
  const std::vector<std::string>& surfaces() const { return header_.surfaces; }
  const std::vector<TrueExposure>& exposures() const { return header_.exposures; }

 private:
  struct Record {
    GpsNs fired;
    std::array<double, 3> beam;  // local level at the scene's origin
    std::array<float, 3> hit;    // from beam: range noise and the wire's step, a few centimetres
    std::uint16_t surface;
    std::array<std::uint8_t, 3> colour, albedo;
    bool is_moving;
    std::array<float, 3> light;
  };
  Judge(const Scenario& scenario, const Config& config);
  /// Where the head was when the lens exposed the row on which the point falls; with a global shutter, at the
  /// exposure's middle.
  Pose T_enu_head(const TrueExposure& exposure, std::size_t lens, Vec3 p_enu) const;
  const Record* find(std::uint16_t channel, GpsNs fired) const;

  Config config_;
  RigTruth rig_;
  Shutter shutter_;
  std::optional<Motion> motion_;  ///< with a rolling shutter
  TruthHeader header_;
  Vec3 origin_ecef_;
  Mat3 R_ecef_scene_;
  std::vector<std::vector<Record>> channels_;
  Figures all_;
  std::vector<Figures> by_lens_;
  std::uint64_t unmatched_ = 0, true_returns_ = 0;
};

}  // namespace hueline::sim
