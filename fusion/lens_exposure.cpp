#include "fusion/lens_exposure.hpp"

#include <algorithm>
#include <cstdint>

namespace hueline::fusion {

const ReportedExposure* report_of(const Image& image, const LensMount& lens) {
  const std::uint32_t x = lens.x_offset + lens.intrinsics.width / 2, y = lens.y_offset + lens.intrinsics.height / 2;
  const auto part = std::find_if(image.reported.begin(), image.reported.end(), [&](const ReportedExposure& one) {
    const PixelRegion& at = one.region;
    return at.width == 0 || (x >= at.x && y >= at.y && x - at.x < at.width && y - at.y < at.height);
  });
  return part == image.reported.end() ? nullptr : &*part;
}

nanoseconds duration_of(const Exposure& exposure, const LensMount& lens) {
  const ReportedExposure* part = report_of(exposure.image, lens);
  return part && part->duration > nanoseconds(0) ? part->duration : exposure.duration;
}

nanoseconds lateness_of(const Exposure& exposure, const LensMount& lens) {
  return (duration_of(exposure, lens) - exposure.duration) / 2;
}

}  // namespace hueline::fusion
