#pragma once

#include <vector>

#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// Returns the factor of each lens on its light at each exposure, on top of CameraConfig::gain. Without automatic
/// exposure all factors are 1. With it each lens meters for itself: the mean of its delivered light (linear, clipped
/// where the sensor saturates) over a grid of its image decides the factor of its next image, which removes the share
/// `auto_exposure_rate` of the logarithmic error. The first image is exposed as if the camera had looked at its scene
/// for a long time before. A head with one shutter meters with all lenses; shutters have steps of 10 us. The result is
/// a function of the scenario alone.
std::vector<std::vector<float>> lens_gains(const Scenario& scenario, const World& world, const Motion& motion,
                                           const RigTruth& rig, std::size_t exposures);

}  // namespace hueline::sim
