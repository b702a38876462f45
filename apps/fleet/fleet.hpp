#pragma once

#include <cstddef>
#include <stop_token>

#include "apps/fleet/plan.hpp"
#include "apps/fleet/task.hpp"

namespace hueline::apps {

/// Tells people how a task ended; `number` counts from 1. `is_new`: it was done now.
void tell_end(const FleetPlan& plan, std::size_t number, const Result<TaskResult>& result, bool is_new);

/// Does the tasks of a plan on this computer, `jobs` at a time, and tells each end. A task that fails does not stop the
/// others. Returns the exit status (FleetState::exit_status()).
int run_fleet(const FleetPlan& plan, int jobs, const Replayer& replay, const std::stop_token& stop);

}  // namespace hueline::apps
