#include <fmt/format.h>

#include <atomic>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "apps/fleet/fleet.hpp"
#include "apps/fleet/state.hpp"
#include "apps/log.hpp"
#include "core/printable.hpp"

namespace hueline::apps {

void tell_end(const FleetPlan& plan, std::size_t number, const Result<TaskResult>& result, bool is_new) {
  const std::string drive = printable(plan.tasks.at(number - 1).name);
  const std::string who = fmt::format("{} of {}, {}", number, plan.tasks.size(), drive);
  if (!result.ok())
    log_error("{}: {}", who, result.error().message);
  else if (result->end == TaskEnd::Done)
    log_info("{}: {} in {:.1f} s on {}, verdict: {}", who, is_new ? "done" : "was done", result->seconds, result->host,
             result->verdict);
  else if (result->end == TaskEnd::Stopped)
    log_warning("{}: stopped", who);
  else
    log_error("{}: {}: {}", who, words(result->end), result->text);
}

int run_fleet(const FleetPlan& plan, int jobs, const Replayer& replay, const std::stop_token& stop) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < plan.tasks.size() && !stop.stop_requested(); i = next++) {
      bool is_new = false;
      const auto result = do_task(plan, plan.tasks[i], replay, stop, &is_new);
      tell_end(plan, i + 1, result, is_new);
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 1; i < jobs; ++i) workers.emplace_back(work);
    work();
  }
  const FleetState state = FleetState::read(plan);
  std::fputs(state.text(plan).c_str(), stdout);
  return state.exit_status();
}

}  // namespace hueline::apps
