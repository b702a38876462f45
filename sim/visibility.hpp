#pragma once

#include <vector>

#include "sim/drive.hpp"
#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// How a lens saw the place of a true return.
enum class Sight : std::uint8_t {
  Visible,     ///< nothing is between lens and place
  Outside,     ///< the place is outside the lens's image or field of view
  OwnVehicle,  ///< the own vehicle is in front of the place
  Occluded,    ///< something else is in front of the place
  /// The place was on something that moves by itself and is elsewhere at the exposure.
  Moved,
};
const char* name(Sight sight);

/// Finds by a ray which exposures truly saw a return. Claims about occlusion are judged by it. It respects rolling
/// shutters: the lens is where it was when the row was exposed. Thread-safe; keeps references to `motion` and `world`.
class Visibility {
 public:
  /// `exposures` are those of the drive's truth. They are needed only if automatic exposure sets the shutter.
  Visibility(const Scenario& scenario, const Motion& motion, const World& world,
             const std::vector<TrueExposure>& exposures = {});

  /// Returns how a lens saw a return. `number` counts exposures from 0 and may lie beyond the drive; `lens` must be a
  /// lens of the rig.
  Sight sight(const TrueReturn& point, std::size_t lens, std::size_t number) const;
  bool is_visible(const TrueReturn& point, std::size_t lens, std::size_t number) const {
    return sight(point, lens, number) == Sight::Visible;
  }

 private:
  const Motion& motion_;
  const World& world_;
  RigTruth rig_;
  Shutter shutter_;
  std::vector<std::vector<float>> lens_gains_;  ///< by exposure
};

}  // namespace hueline::sim
