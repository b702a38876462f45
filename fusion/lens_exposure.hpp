#pragma once

#include "core/stamped.hpp"
#include "fusion/rig_geometry.hpp"

/// What an exposure was for one of the lenses in its image.
namespace hueline::fusion {

/// Returns what the camera reports of a lens's exposure, or null. `lens` is one of its lenses.
const ReportedExposure* report_of(const Image& image, const LensMount& lens);
/// Returns how long a lens was exposed; 0 if nobody says.
nanoseconds duration_of(const Exposure& exposure, const LensMount& lens);
/// Returns how much later than Exposure::exposure_mid the middle of a lens's exposure is: the lenses of an image begin
/// together.
nanoseconds lateness_of(const Exposure& exposure, const LensMount& lens);

}  // namespace hueline::fusion
