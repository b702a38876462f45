#pragma once

#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// How a lens saw the place of a true return.
enum class Sight : std::uint8_t {
  Visible,     ///< nothing between lens and place
  Outside,     ///< beyond the lens's image or field of view
  OwnVehicle,  ///< the mapping vehicle is before it
  Occluded,    ///< something else is before it
  Moved,       ///< it lay on something that moves by itself, which is elsewhere at the exposure
};
const char* name(Sight sight);

/// Asks the world, by a ray, which exposures truly saw a return: the judge of every claim about occlusion. Rolling
/// shutters count: the lens is where it was when the row was exposed. Thread-safe; keeps references to motion and
/// world.
class Visibility {
 public:
  Visibility(const Scenario& scenario, const Motion& motion, const World& world);

  /// `number` counts exposures from 0 (those beyond the drive are as good as any). `lens` must be one of the rig's.
  Sight sight(const TrueReturn& point, std::size_t lens, std::size_t number) const;
  bool is_visible(const TrueReturn& point, std::size_t lens, std::size_t number) const {
    return sight(point, lens, number) == Sight::Visible;
  }

 private:
  const Motion& motion_;
  const World& world_;
  RigTruth rig_;
  Shutter shutter_;
};

}  // namespace hueline::sim
