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

/// A coloured point as the program under test states it.
struct Claim {
  GpsNs fired_gps_ns = 0;     ///< time of its firing; a difference of a microsecond does no harm
  std::uint16_t channel = 0;  ///< ring, counted from the lowest elevation
  /// Number of the exposure that gave the colour, as the simulated camera counts from 0.
  std::uint32_t exposure = 0;
  std::uint8_t lens = 0;
  bool is_panorama_pixel = false;  ///< whether u, v are a pixel of the panorama; otherwise of the lens image
  double u = 0, v = 0;             ///< pixel that gave the colour; pixel centres are whole numbers
  std::uint8_t red = 0, green = 0, blue = 0;
  std::optional<Vec3> place_ecef;  ///< where the program puts the point, m
};

/// What is wrong with one claim.
struct Verdict {
  TruePixel expected;  ///< pixel on which the true point falls in the true image
  /// Angle between the rays of the claimed and the true pixel, in pixels of the panorama (width / (2 pi) pixels a
  /// radian).
  double error_px = 0;
  double colour_difference = 0;  ///< largest difference of the three channels from the colour of TrueReturn, 0 .. 255
  double place_error_m = 0;      ///< distance from the place of TrueReturn's beam; 0 if no place was claimed
  double distance_m = 0;         ///< distance of the true point from the head at the exposure
  std::uint16_t surface = 0;
};

/// Distribution of one figure. Mean square and maximum are exact, quantiles are good to 1 %.
class Spread {
 public:
  void add(double x);
  std::uint64_t count() const { return count_; }
  /// Returns the root mean square; 0 without values.
  double rms() const;
  double max() const { return max_; }
  /// Returns the smallest value that the share `share` of the values do not exceed.
  double quantile(double share) const;

 private:
  static constexpr std::size_t kBins = 2400;  // bins for 1e-6 .. 1e5, each about 1 % wide
  std::uint64_t count_ = 0;
  double sum_square_ = 0, max_ = 0;
  std::vector<std::uint64_t> bins_;
};

/// Compares coloured points with the truth of a drive, by the simulator's own projection. The true point is the true
/// place of the scanner plus the true beam x the range on the wire; it is projected from the true pose at the true
/// middle of the exposure. Shares no code with fusion/.
/// Thread safety: `judge()` and the other const functions may be called from several threads; `add()` may not.
class Judge {
 public:
  struct Config {
    double panorama_width = 8000, panorama_height = 4000;
    double forward_column = 3999.5;  ///< column of the panorama in the direction of the head's +x axis
    bool is_clockwise = true;        ///< whether columns grow clockwise seen from above
    /// A claim is unmatched if every firing of its channel is farther away in time than this, or, of a profile scanner,
    /// farther than 0.4 of the time between pulses.
    std::int64_t match_ns = 20'000;
    std::string validate() const;
  };
  /// Reads the whole truth into memory (72 bytes a return). Errors: Io, Malformed, Invalid.
  static Result<Judge> open(const Scenario& scenario, const std::string& truth_file, const Config& config);

  /// Returns the verdict on a claim. Empty if there is no such firing, exposure or lens, or if the true point is beyond
  /// the lens's field of view.
  std::optional<Verdict> judge(const Claim& claim) const;
  /// Returns the truth of the firing that a claim names, found as `judge()` finds it; empty if there is none.
  std::optional<TrueReturn> true_return(std::uint16_t channel, GpsNs fired) const;
  /// Returns the pixel of the panorama on which a direction in the head's frame falls.
  TruePixel panorama_pixel(Vec3 direction_head) const;
  /// Returns the direction (unit length) in the head's frame of a pixel of the panorama.
  Vec3 panorama_direction(TruePixel pixel) const;

  /// The distributions of the errors of all judged claims.
  struct Figures {
    Spread error_px, colour_difference, place_error_m;
  };
  /// Judges a claim and adds the verdict to the figures.
  void add(const Claim& claim);
  const Figures& all() const { return all_; }
  const std::vector<Figures>& by_lens() const { return by_lens_; }
  /// Returns how many claims could not be judged. The figures do not contain them, so show this number beside the
  /// figures.
  std::uint64_t unmatched() const { return unmatched_; }
  std::uint64_t true_returns() const { return true_returns_; }
  const std::vector<std::string>& surfaces() const { return header_.surfaces; }
  const std::vector<TrueExposure>& exposures() const { return header_.exposures; }

 private:
  struct Record {
    GpsNs fired;
    std::array<double, 3> beam;  // place of the beam's end in the scene's local level, m
    std::array<float, 3> hit;    // true hit minus `beam`, m: range noise and the wire's step, a few centimetres
    std::uint16_t surface;
    std::array<std::uint8_t, 3> colour, albedo;
    bool is_moving;
    std::array<float, 3> light;
  };
  Judge(const Scenario& scenario, const Config& config);
  /// Returns the pose of the head when the lens exposed the row on which the point falls; if all pixels are exposed at
  /// once, the pose at the middle of the exposure.
  Pose T_enu_head(const TrueExposure& exposure, std::size_t lens, Vec3 p_enu) const;
  const Record* find(std::uint16_t channel, GpsNs fired) const;

  Config config_;
  RigTruth rig_;
  Shutter shutter_;
  std::optional<Motion> motion_;  ///< filled if pixels are exposed at different times
  TruthHeader header_;
  Vec3 origin_ecef_;
  Mat3 R_ecef_scene_;
  std::vector<std::vector<Record>> channels_;
  Figures all_;
  std::vector<Figures> by_lens_;
  std::uint64_t unmatched_ = 0, true_returns_ = 0;
};

}  // namespace hueline::sim
