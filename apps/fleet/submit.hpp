#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/fleet/plan.hpp"
#include "core/result.hpp"

/// A plan for the schedulers of clusters. They all call `hueline fleet task PLAN NUMBER`; what they know of a task is
/// its number and its exit status.
namespace hueline::apps {

/// What a scheduler is asked for. Empty texts and 0 leave it to the scheduler.
struct SubmitWish {
  std::string partition, time, memory;  ///< as Slurm's options of these names have them
  int threads = 2;                      ///< processors of a task
  int at_once = 0;                      ///< most tasks that run at the same time
  std::vector<std::string> further;     ///< further words for sbatch
};

/// Slurm's MaxArraySize is 1001 unless a cluster says otherwise; more tasks become several arrays.
inline constexpr std::size_t kMostArrayTasks = 1000;

/// Returns the folder that a scheduler's files are kept in: in that of the results, beside the drives.
std::filesystem::path engine_folder(const FleetPlan& plan, const std::string& engine);

/// Returns a batch script for Slurm: a job array with an element for each of these tasks, at most kMostArrayTasks.
/// `hueline` is the program that the nodes start. A task whose node fails is queued again. Errors: Invalid if a wish or
/// a path has signs that such a script cannot hold.
Result<std::string> slurm_script(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish,
                                 const std::filesystem::path& hueline);

/// Returns a Snakefile, in the language of Snakemake, with a rule for these tasks.
std::string snakefile(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish,
                      const std::filesystem::path& hueline);

/// Writes the scripts for the tasks that are to be done, and gives them to sbatch unless `only_write`. Returns the exit
/// status of the command.
int submit_to_slurm(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish,
                    bool only_write);
/// Writes the Snakefile, and says how it is run. Returns the exit status of the command.
int write_snakefile(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish);

}  // namespace hueline::apps
