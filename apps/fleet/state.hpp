#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/fleet/plan.hpp"
#include "apps/fleet/task.hpp"

namespace hueline::apps {

/// Where the tasks of a plan stand, as their folders say. Nothing else keeps it, so it is the same whoever does the
/// tasks.
struct FleetState {
  /// By the task's place in the plan; nothing if the task is open.
  std::vector<std::optional<TaskResult>> results;

  /// Reads it. The products of a task count if they are as long as they were written.
  static FleetState read(const FleetPlan& plan);

  /// Returns the numbers of the tasks that are not done and would not end in the same way again: the open ones, and
  /// those that failed without results.
  std::vector<std::size_t> to_do() const;
  /// Returns the exit status: kDone if all tasks are done; kStopped if some are open; else the status that all failed
  /// tasks share, or kFailed.
  int exit_status() const;
  /// Returns how many tasks are done, the failed ones by cause and the open ones, with their names.
  std::string text(const FleetPlan& plan) const;
};

}  // namespace hueline::apps
