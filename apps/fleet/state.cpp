#include "apps/fleet/state.hpp"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "apps/exit_code.hpp"
#include "core/printable.hpp"

namespace hueline::apps {
namespace {

/// Returns the beginning of the list of names, and how many more there are.
std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 20;
  std::string out;
  for (std::size_t i = 0; i < names.size() && i < kShown; ++i) out += (i > 0 ? ", " : "") + names[i];
  return names.size() > kShown ? fmt::format("{} and {} more", out, names.size() - kShown) : out;
}

}  // namespace

FleetState FleetState::read(const FleetPlan& plan) {
  FleetState out;
  for (const FleetTask& task : plan.tasks) {
    auto result = finished_result(plan, task, Check::Sizes);
    out.results.push_back(result ? std::move(result) : failed_result(plan, task));
  }
  return out;
}

std::vector<std::size_t> FleetState::to_do() const {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < results.size(); ++i)
    if (!results[i] || !has_results(results[i]->end)) out.push_back(i + 1);
  return out;
}

int FleetState::exit_status() const {
  std::set<int> statuses;
  for (const auto& result : results) {
    if (!result) return kStopped;
    if (result->end != TaskEnd::Done) statuses.insert(apps::exit_status(result->end));
  }
  return statuses.empty() ? kDone : statuses.size() == 1 ? *statuses.begin() : kFailed;
}

std::string FleetState::text(const FleetPlan& plan) const {
  std::map<std::string, std::size_t> verdicts;
  std::map<TaskEnd, std::vector<std::string>> failed;
  std::vector<std::string> open;
  std::map<std::string, std::size_t> hosts;
  std::size_t done = 0;
  double seconds = 0;
  std::string reasons;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const std::string drive = printable(plan.tasks[i].name);
    if (!results[i]) {
      open.push_back(drive);
      continue;
    }
    const TaskResult& result = *results[i];
    seconds += result.seconds;
    ++hosts[result.host];
    if (result.end == TaskEnd::Done) {
      ++done;
      ++verdicts[result.verdict];
      continue;
    }
    failed[result.end].push_back(drive);
    reasons += fmt::format("  {}: {}\n", drive, printable(result.text));
  }
  std::string out = fmt::format("{} of {} drives done", done, results.size());
  for (const auto& [verdict, count] : verdicts)
    if (!verdict.empty()) out += fmt::format("; {} {}", count, printable(verdict));
  out += '\n';
  for (const auto& [end, drives] : failed)
    out += fmt::format("{} failed, {}: {}\n", drives.size(), words(end), list_of(drives));
  out += reasons;
  if (!open.empty()) out += fmt::format("{} open: {}\n", open.size(), list_of(open));
  if (!hosts.empty())
    out += fmt::format("{:.0f} s of work on {}\n", seconds,
                       hosts.size() == 1 ? hosts.begin()->first : fmt::format("{} computers", hosts.size()));
  return out;
}

}  // namespace hueline::apps
