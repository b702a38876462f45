#pragma once

#include <vector>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// Stamp minus true second, ns, of each whole second from begin to end. Gaussian jitter about the interrupt's mean
/// latency (which nothing can see, hence 0) and rare late spikes; all zero with noise off.
std::vector<std::int64_t> simulate_pps(const Scenario& scenario);

}  // namespace hueline::sim
