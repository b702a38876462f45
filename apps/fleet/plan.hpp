#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

/// The plan of a fleet: which drives are fused again, each by one task, and with what (docs/fleet.md, which also has
/// the form of the file). Whoever executes it, this program or a cluster's scheduler, does the same tasks.
namespace hueline::apps {

/// What a file is for in a replay.
enum class InputRole : std::uint8_t { Recording, Rig, Trajectory, TrajectorySigma };
/// Returns the word of the plan: "recording", "rig", "trajectory", "trajectory_sigma".
const char* name(InputRole role);

/// A file that a task reads, as it was when the plan was made.
struct FleetInput {
  InputRole role = InputRole::Recording;
  std::filesystem::path file;  ///< absolute, or an address (core/remote_store.hpp)
  std::uint64_t bytes = 0;
  std::string sha256;  ///< 64 small hexadecimal digits
};

/// One drive that is fused again. The options are those of `hueline replay`.
struct FleetTask {
  std::string name;                               ///< of the drive, unique in the plan; also the folder of its results
  std::vector<FleetInput> inputs;                 ///< the recording's segments first, in their order
  std::string trajectory_time, trajectory_point;  ///< empty without a trajectory

  /// Returns the file that `hueline replay` is given as the recording.
  const std::filesystem::path& recording() const { return inputs.front().file; }
  /// Returns the words that follow `hueline replay RECORDING`.
  std::vector<std::string> options() const;
};

/// The tasks, and the program that does them. A task has a number from 1 on, its place in the list.
struct FleetPlan {
  std::filesystem::path file;         ///< of the plan, absolute
  std::string version, git_revision;  ///< of the program that made the plan; no other may do its tasks
  std::vector<FleetTask> tasks;

  /// Returns the folder in which each task has the folder of its results: that of the plan's file without ".json".
  std::filesystem::path results() const;
  nlohmann::ordered_json json() const;
};

/// Returns what a task is asked for: the digests of its inputs and the options, without the names of files. Two tasks
/// of which this is equal give the same bytes.
nlohmann::ordered_json question_of(const FleetPlan& plan, const FleetTask& task);

/// What a user asks a plan for. In `rig`, `trajectory` and `trajectory_sigma` the text `{drive}` stands for the name of
/// the drive. Empty texts ask for nothing.
struct FleetWish {
  std::vector<std::string> drives;  ///< recordings, or folders of drives
  std::string rig, trajectory, trajectory_sigma, trajectory_time, trajectory_point;
};

/// Makes a plan and reads every input once for its digest. `file` is where the plan will be written. Errors: Invalid if
/// the name of a file is no text or names no plan, or a drive is named twice; Io or another of InputFile::open() if
/// inputs cannot be read, with all of them in the message, one a line.
Result<FleetPlan> make_plan(const FleetWish& wish, const std::filesystem::path& file);

/// Reads a plan. Errors: those of read_input(); Malformed with the place in the file if it is no plan of this version;
/// Invalid for a name that no plan has.
Result<FleetPlan> read_plan(const std::filesystem::path& file);

}  // namespace hueline::apps
