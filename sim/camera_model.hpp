#pragma once

#include <stop_token>
#include <vector>

#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/tone.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// The panoramic head. It begins to expose all lenses at one moment and gives one raw image, in which the images of the
/// lenses are stacked. The image is a Bayer mosaic (BayerRG8: red at even rows and even columns of the stack).
/// Thread safety: const functions may be called from several threads. Keeps references to `motion` and `world`.
class PanoramicCamera {
 public:
  PanoramicCamera(const Scenario& scenario, const Motion& motion, const World& world);

  std::size_t exposure_count() const { return exposures_; }
  /// Returns the time of the strobe's edge.
  GpsNs exposure_start(std::size_t number) const { return shutter_.start(number); }
  /// Returns how long an exposure lasts, and its middle; where lenses differ, those of the mean.
  GpsNs exposure_ns(std::size_t number) const { return shutter_.exposure_ns(gains_[number]); }
  GpsNs exposure_mid(std::size_t number) const { return shutter_.mid(number, gains_[number]); }
  const Shutter& shutter() const { return shutter_; }
  /// Returns the factor of each lens on its light, on top of CameraConfig::gain: the truth of automatic exposure.
  const std::vector<float>& lens_gains(std::size_t number) const { return gains_[number]; }
  /// Returns the pose of the head at the middle of the exposure.
  Pose T_enu_head(std::size_t number) const;

  /// Returns the raw bytes of one exposure. They do not depend on `threads`, because the noise of a pixel is a function
  /// of seed, exposure and pixel.
  std::vector<std::uint8_t> expose(std::size_t number, unsigned threads) const;
  /// Returns the same for one lens; the others are black.
  std::vector<std::uint8_t> expose_lens(std::size_t number, std::size_t lens) const;

 private:
  struct Lens {
    TrueLens optics;
    /// Direction of each pixel in the lens frame (x, y, z); 0 0 0 where the lens images nothing.
    std::vector<float> directions;
    float cone = 0;  ///< opening angle of a pixel's cone, rad
    float dim = 0;   ///< vignetting: the share of light that arrives is 1 - dim (1 - cos theta)
  };
  struct Block;  // a few rows of one lens, the work that one thread takes at a time
  /// The moments that are averaged over an exposure: one list for all rows, or one for each row with a rolling shutter.
  using Moments = std::vector<std::vector<Moment>>;
  std::vector<Moment> moments(std::size_t number, std::size_t lens, double row) const;
  Moments moments_of_lens(std::size_t number, std::size_t lens) const;
  void expose_rows(std::size_t number, std::size_t lens, const Moments& all_rows, Block& block,
                   std::vector<std::uint8_t>& image) const;
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
  std::vector<std::vector<float>> gains_;  ///< factors by exposure and lens, see lens_gains()
};

}  // namespace hueline::sim
