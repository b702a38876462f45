#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/fleet/plan.hpp"
#include "core/result.hpp"

/// A task of a plan: what it does, and what it leaves. A task replays one drive with `hueline replay`, in a folder that
/// nobody takes for results, and gives that folder the drive's name when everything in it is whole. So a task that was
/// killed leaves no results, and doing it again gives the same bytes.
namespace hueline::apps {

/// How a task ended.
enum class TaskEnd : std::uint8_t {
  Done,           ///< the results are there
  Damaged,        ///< an input is damaged: the results are those of what is whole
  Empty,          ///< no point could be made
  InputChanged,   ///< an input is not what it was when the plan was made
  InputMissing,   ///< an input cannot be read
  OtherProgram,   ///< this program is not the one that made the plan
  Refused,        ///< the rig or the trajectory does not fit the drive
  OutputRefused,  ///< the results could not be written
  Crashed,        ///< a signal ended the replay: a fault of the program, or no memory was left
  Stopped,        ///< somebody stopped it; nothing is wrong
  Failed,         ///< anything else; the log has it
};
/// Returns the word of result.json: "done", "damaged", ...
const char* name(TaskEnd end);
/// Returns it in words for people: "an input cannot be read".
const char* words(TaskEnd end);
/// Returns whether a task that ended so has left results, which it would give again.
bool has_results(TaskEnd end);
/// Returns the exit status of `hueline fleet task`.
int exit_status(TaskEnd end);

/// A file of the results.
struct FleetProduct {
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// What came of a task: the file result.json beside its products, or beside the log of a task that failed.
struct TaskResult {
  TaskEnd end = TaskEnd::Failed;
  std::string text;     ///< why; empty if it is done
  std::string verdict;  ///< of the drive: "good", "usable with remarks", "drive again"; empty without results
  std::string host;     ///< the computer that did it
  double seconds = 0;   ///< wall time, with reading and writing
  std::map<std::string, FleetProduct> products;

  nlohmann::ordered_json json(const nlohmann::ordered_json& question) const;
};

/// Returns where the results of a task are, and what a failed one leaves.
std::filesystem::path results_of(const FleetPlan& plan, const FleetTask& task);
std::filesystem::path failure_of(const FleetPlan& plan, const FleetTask& task);

/// How thoroughly products are compared with result.json. Sizes find what a power cut has left empty.
enum class Check : std::uint8_t { Sizes, Digests };

/// Returns the result of a task that has results: those of what the plan asks for, whole. Returns nothing if the task
/// is still to be done; `why`, if given, receives the reason if there is something in its place.
std::optional<TaskResult> finished_result(const FleetPlan& plan, const FleetTask& task, Check check,
                                          std::string* why = nullptr);
/// Returns the result of the last attempt that failed; nothing if there was none.
std::optional<TaskResult> failed_result(const FleetPlan& plan, const FleetTask& task);

/// Starts `hueline replay` with these words, its messages in the file `log`, and returns its exit status, 128 + its
/// number if a signal ended it. Ends it if `stop` asks for it. Errors: Io if it cannot be started.
using Replayer = std::function<Result<int>(const std::vector<std::string>& words, const std::filesystem::path& log,
                                           const std::stop_token& stop)>;
/// Returns the Replayer that starts the program `hueline` beside this one, with that many threads. Thread-safe.
Replayer hueline_replayer(int threads);

/// Does a task, unless its results are there already. It can be called for the same task by several programs at the
/// same time: each works in a folder of its own, and the first one to end leaves the results. `is_new`, if given, is
/// set to whether the task was done now. Errors: Io if not even a failure can be written down. Thread-safe.
Result<TaskResult> do_task(const FleetPlan& plan, const FleetTask& task, const Replayer& replay,
                           const std::stop_token& stop, bool* is_new = nullptr);

}  // namespace hueline::apps
