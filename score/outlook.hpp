#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "score/ciede2000.hpp"
#include "sim/judge.hpp"
#include "sim/shutter.hpp"
#include "sim/tone.hpp"
#include "sim/world.hpp"

namespace hueline::score {

/// The number of the own vehicle among sim::World::surfaces().
constexpr std::uint16_t kOwnVehicle = 1;

/// What every lens of every exposure truly sees. It casts rays into the simulator's world from the true pose at the
/// true middle of the exposure, or, with a rolling shutter, at the time when the row was exposed. Immutable; const
/// functions are thread-safe.
class Outlook {
 public:
  /// A ray meets a place if it meets something no farther than this before or behind it.
  static constexpr double kTolerance_m = 0.05;

  /// A place of the scene's local level in the image of a lens at an exposure.
  struct Sight {
    std::uint32_t exposure = 0;
    std::size_t lens = 0;
    sim::TruePixel pixel;
    double distance_m = 0;  ///< distance from the lens
    sim::GpsNs time = 0;    ///< when that pixel was exposed
    sim::Vec3 eye;          ///< where the lens was at that time
  };
  /// What the ray met. Before: something else, which hides the place. Behind: nothing is at the place any more.
  enum class Met { Place, Before, Behind };
  /// What a ray met, in relation to the place and in detail.
  struct Look {
    Met met = Met::Place;
    sim::Seen seen;
  };

  Outlook(const sim::Scenario& scenario, const std::vector<sim::TrueExposure>& exposures);

  /// Returns where the image of a lens shows a place; empty if the place is outside the image.
  std::optional<Sight> sight(std::uint32_t exposure, std::size_t lens, sim::Vec3 place) const;
  /// Looks along the ray of a sight.
  Look look(const Sight& sight, sim::Vec3 place) const;
  /// Returns at most `count` exposures, in the order of the distance of their middles from `t`.
  std::vector<std::uint32_t> nearest_exposures(sim::GpsNs t, std::size_t count) const;
  /// The radii, in pixels of the lens, at which `edges_around()` looks in eight directions around a sight.
  static constexpr std::array<double, 4> kRadii_px{1, 2, 4, 8};
  /// Indices into kRadii_px; the size of kRadii_px where there is no edge.
  struct Edges {
    std::size_t outline = kRadii_px.size(), any = kRadii_px.size();
  };
  /// Finds the smallest radius at which one of the directions meets an outline (the distance departs from that of a
  /// plane by more than 0.1 m + 5 %), and the smallest radius at which one meets an outline or an edge of the texture
  /// (the colour differs by more than 10 dE00).
  Edges edges_around(const Sight& sight, sim::Vec3 place) const;

  /// Returns the tone of a perfect camera at one gain for the whole drive: that of the first lens at the first
  /// exposure. No camera knows how bright the world is; where lenses choose their gains themselves, colours are
  /// therefore relative to that image, as the colouring defines it.
  const sim::Tone& tone() const { return tone_; }
  /// Returns the factor of that lens at that exposure.
  double reference_gain() const { return reference_gain_; }

  const sim::World& world() const { return world_; }
  const sim::RigTruth& rig() const { return rig_; }
  std::size_t lens_count() const { return rig_.lenses.size(); }

 private:
  struct Station {
    sim::GpsNs mid = 0;
    sim::Moment moment;
    sim::Pose T_enu_head;
    std::vector<float> lens_gain;
  };
  Lab lab_of(const sim::Seen& seen) const;
  /// Returns the world at the time of a sight.
  sim::Moment moment_of(const Sight& sight) const;

  sim::Motion motion_;
  sim::World world_;
  sim::RigTruth rig_;
  sim::Shutter shutter_;
  double reference_gain_;
  sim::Tone tone_;
  LabOfRgb lab_;
  std::vector<Station> stations_;
};

/// Returns how the 8 bits of a scenario's camera encode light.
LabOfRgb::Encoding encoding_of(const sim::Scenario& scenario);

}  // namespace hueline::score
