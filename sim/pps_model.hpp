#pragma once

#include <vector>

#include "sim/scenario.hpp"

namespace hueline::sim {

/// Returns the stamp of the edge minus the true second, ns, for each whole second from begin to end. The error is
/// Gaussian jitter about the mean latency of the interrupt (taken as 0, because nothing can observe it) and a rare late
/// spike. All errors are zero without noise.
std::vector<std::int64_t> simulate_pps(const Scenario& scenario);

}  // namespace hueline::sim
