#pragma once

#include <optional>
#include <vector>

#include "score/ciede2000.hpp"
#include "sim/judge.hpp"
#include "sim/shutter.hpp"
#include "sim/tone.hpp"
#include "sim/world.hpp"

namespace hueline::score {

/// What every lens of every exposure truly sees: the simulator's world under rays, from the true pose at the true
/// middle of the exposure, or of the row's exposure where the shutter rolls. Immutable; const functions are
/// thread-safe.
class Outlook {
 public:
  /// Something lies between a lens and a place if a ray meets it more than this before the place.
  static constexpr double kTolerance_m = 0.05;

  /// A place of the scene's local level as a lens of an exposure has it in its image.
  struct Sight {
    std::uint32_t exposure = 0;
    std::size_t lens = 0;
    sim::TruePixel pixel;
    double distance_m = 0;  ///< from the lens
    sim::GpsNs time = 0;    ///< when that pixel was exposed
    sim::Vec3 eye;          ///< where the lens was then
  };
  enum class Met { Place, Before, Behind };  ///< Before: something else hides it; Behind: nothing is there any more
  struct Look {
    Met met = Met::Place;
    sim::Seen seen;
  };

  Outlook(const sim::Scenario& scenario, const std::vector<sim::TrueExposure>& exposures);

  /// Empty if the place is outside the lens's image.
  std::optional<Sight> sight(std::uint32_t exposure, std::size_t lens, sim::Vec3 place) const;
  /// Along the ray of a sight.
  Look look(const Sight& sight, sim::Vec3 place) const;
  /// Exposures by distance of their middles from `t`, at most `count`.
  std::vector<std::uint32_t> nearest_exposures(sim::GpsNs t, std::size_t count) const;
  /// Smallest of kRadii_px (of the lens) at which one of eight directions around a sight meets an outline (a step of
  /// the distance by more than 0.1 m + 5 %), and likewise an outline or texture edge (step of the colour above 10
  /// dE00). kRadii: none.
  static constexpr std::array<double, 4> kRadii_px{1, 2, 4, 8};
  struct Edges {
    std::size_t outline = kRadii_px.size(), any = kRadii_px.size();  ///< index into kRadii_px
  };
  Edges edges_around(const Sight& sight, sim::Vec3 place) const;

  /// What a perfect camera makes of light at the drive's mean gain: no camera knows how bright the world is, so where
  /// lenses choose their gain by themselves the truth is told at the geometric mean of what they chose.
  const sim::Tone& tone() const { return tone_; }
  double mean_lens_gain() const { return mean_lens_gain_; }

  const sim::World& world() const { return world_; }
  const sim::RigTruth& rig() const { return rig_; }
  std::size_t lens_count() const { return rig_.lenses.size(); }

 private:
  struct Station {
    sim::GpsNs mid = 0;
    sim::Moment moment;
    sim::Pose T_enu_head;
  };
  Lab lab_of(const sim::Seen& seen) const;
  /// The world at the moment of a sight.
  sim::Moment moment_of(const Sight& sight) const;

  sim::Motion motion_;
  sim::World world_;
  sim::RigTruth rig_;
  sim::Shutter shutter_;
  double mean_lens_gain_;
  sim::Tone tone_;
  LabOfRgb lab_;
  std::vector<Station> stations_;
};

LabOfRgb::Encoding encoding_of(const sim::Scenario& scenario);

}  // namespace hueline::score
