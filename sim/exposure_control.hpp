#pragma once

#include <vector>

#include "sim/rig_truth.hpp"
#include "sim/shutter.hpp"
#include "sim/world.hpp"

namespace hueline::sim {

/// Gain of each lens at each exposure, beside CameraConfig::gain: all 1 without automatic exposure. With it each lens
/// meters for itself: the mean of its delivered light (linear, clipped where the sensor saturates) over a grid of its
/// image decides the gain of its next image, which mends `auto_exposure_rate` of the logarithmic error. The first image
/// is exposed as if the camera had looked at it for long. A function of the scenario alone.
std::vector<std::vector<float>> lens_gains(const Scenario& scenario, const World& world, const Motion& motion,
                                           const RigTruth& rig, std::size_t exposures);

}  // namespace hueline::sim
