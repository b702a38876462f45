#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

namespace hueline::calibration {

/// The inside of RingFilter::keep. `rings`: at least one pair of squared distances, disjoint.
void keep_in_rings(const float* xyz, std::size_t count, const std::pair<float, float>* rings, std::size_t ring_count,
                   std::vector<Eigen::Vector3f>& kept, float& farthest_squared);

}  // namespace hueline::calibration
