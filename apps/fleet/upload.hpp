#pragma once

#include <string>

#include "apps/fleet/plan.hpp"

namespace hueline::apps {

/// Puts the results of every task of a plan that has some below an address of object storage, a folder for each drive,
/// result.json last: where it is, everything that it names is there. What is there already is not sent again. It says
/// what it did, and which results stay here. Returns the exit status: kOutputRefused if the storage does not take all
/// of them, kStopped if tasks are still to be done.
int upload_results(const FleetPlan& plan, const std::string& address);

}  // namespace hueline::apps
