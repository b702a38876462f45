#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

namespace hueline::calibration {

/// The inner loop of RingFilter::keep. `rings` has at least one pair of squared distances; the pairs are disjoint.
void keep_in_rings(const float* xyz, std::size_t count, const std::pair<float, float>* rings, std::size_t ring_count,
                   std::vector<Eigen::Vector3f>& kept, float& farthest_squared);

}  // namespace hueline::calibration
