#pragma once

#include <stop_token>
#include <vector>

#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/tone.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// The panoramic head: all lenses at one moment, one stacked Bayer image (BayerRG8: red at even row, even column of the
/// stack).
class PanoramicCamera {
 public:
  PanoramicCamera(const Scenario& scenario, const Motion& motion, const World& world);

  std::size_t exposure_count() const { return exposures_; }
  /// The strobe's edge.
  GpsNs exposure_start(std::size_t number) const { return shutter_.start(number); }
  GpsNs exposure_ns() const { return shutter_.exposure_ns(); }
  GpsNs exposure_mid(std::size_t number) const { return shutter_.mid(number); }
  /// What each lens multiplied its light with, beside CameraConfig::gain: the truth of automatic exposure.
  const std::vector<float>& lens_gains(std::size_t number) const { return gains_[number]; }
  /// Pose of the head at the middle of an exposure.
  Pose T_enu_head(std::size_t number) const;

  /// Raw bytes of one exposure. The same for any number of threads: each pixel's noise is a function of (seed,
  /// exposure, pixel).
  std::vector<std::uint8_t> expose(std::size_t number, unsigned threads) const;

 private:
  struct Lens {
    TrueLens optics;
    std::vector<float> directions;  ///< x, y, z of each pixel in the lens frame; 0 0 0 where the lens images nothing
    float cone = 0;                 ///< angle of a pixel, rad
    float dim = 0;                  ///< vignetting: light = 1 - dim (1 - cos theta)
  };
  struct Block;  // a few rows of one lens: what a thread takes at a time
  /// Moments over which rows are exposed: of all rows, or of each row with a rolling shutter.
  using Moments = std::vector<std::vector<Moment>>;
  std::vector<Moment> moments(std::size_t number, double row) const;
  void render(const Lens& lens, const Moments& moments, Block& block) const;
  void smooth_outlines(const Lens& lens, const Moments& moments, Block& block) const;
  void sample_outlines(const Lens& lens, const Moment& moment, const std::vector<std::size_t>& edges, float share,
                       std::span<const std::array<float, 2>> offsets, Block& block) const;
  void develop(std::size_t number, std::size_t lens, const Block& block, std::vector<std::uint8_t>& image) const;

  Scenario scenario_;
  const Motion& motion_;
  const World& world_;
  RigTruth rig_;
  Tone tone_;
  std::vector<Lens> lenses_;
  Shutter shutter_;
  std::size_t exposures_;
  std::vector<std::vector<float>> gains_;  ///< by exposure and lens
};

}  // namespace hueline::sim
