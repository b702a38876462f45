// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calibration/targets/ring_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "calibration/targets/ring_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::calibration::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void keep_in_rings(const float* xyz, std::size_t count, const std::pair<float, float>* rings, std::size_t ring_count,
                   std::vector<Eigen::Vector3f>& kept, float& farthest_squared) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  auto farthest = hn::Set(d, farthest_squared);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::Vec<decltype(d)> x, y, z;
    hn::LoadInterleaved3(d, xyz + 3 * i, x, y, z);
    const auto squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    // Comparisons with NaN are false, so that NaN is left out.
    farthest = hn::IfThenElse(hn::Gt(squared, farthest), squared, farthest);
    auto inside = hn::And(hn::Ge(squared, hn::Set(d, rings[0].first)), hn::Le(squared, hn::Set(d, rings[0].second)));
    for (std::size_t r = 1; r < ring_count; ++r)
      inside = hn::Or(
          inside, hn::And(hn::Ge(squared, hn::Set(d, rings[r].first)), hn::Le(squared, hn::Set(d, rings[r].second))));
    if (hn::AllFalse(d, inside)) continue;
    std::uint8_t bits[(HWY_MAX_BYTES / sizeof(float) + 7) / 8 + 8] = {};
    hn::StoreMaskBits(d, inside, bits);
    for (std::size_t lane = 0; lane < lanes; ++lane)
      if (bits[lane / 8] >> (lane % 8) & 1)
        kept.emplace_back(xyz[3 * (i + lane)], xyz[3 * (i + lane) + 1], xyz[3 * (i + lane) + 2]);
  }
  farthest_squared = hn::GetLane(hn::MaxOfLanes(d, farthest));
  for (; i < count; ++i) {
    const float *p = xyz + 3 * i, squared = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    if (squared > farthest_squared) farthest_squared = squared;
    for (std::size_t r = 0; r < ring_count; ++r) {
      if (!(squared >= rings[r].first && squared <= rings[r].second)) continue;
      kept.emplace_back(p[0], p[1], p[2]);
      break;
    }
  }
}

}  // namespace hueline::calibration::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::calibration {
HWY_EXPORT(keep_in_rings);

void keep_in_rings(const float* xyz, std::size_t count, const std::pair<float, float>* rings, std::size_t ring_count,
                   std::vector<Eigen::Vector3f>& kept, float& farthest_squared) {
  HWY_DYNAMIC_DISPATCH(keep_in_rings)(xyz, count, rings, ring_count, kept, farthest_squared);
}
}  // namespace hueline::calibration
#endif
