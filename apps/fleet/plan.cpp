#include "apps/fleet/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "apps/log.hpp"
#include "apps/sha256.hpp"
#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/printable.hpp"
#include "core/remote_store.hpp"
#include "runtime/recording.hpp"
#include "runtime/version.hpp"
#include "storage/journal_segments.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kFormat = 1;
constexpr std::array kRoles{InputRole::Recording, InputRole::Rig, InputRole::Trajectory, InputRole::TrajectorySigma};
constexpr std::uint64_t kLargestPlan = 1'000'000'000;  // bytes; a task takes about 500

/// Returns the folder's name for a recording that has the name that captures give, and the file's own for others.
std::string drive_name(const fs::path& recording) {
  const std::string stem = recording.stem().string();
  return stem == "drive" && recording.has_parent_path() ? recording.parent_path().filename().string() : stem;
}

/// Gives the drives names that differ: the last parts of their paths, as many as it takes.
std::vector<std::string> names_of(const std::vector<fs::path>& recordings) {
  struct Naming {
    std::string name;
    fs::path above;  // whose last part comes before the name if it is not unique
  };
  std::vector<Naming> names;
  for (const fs::path& recording : recordings) {
    Naming one{drive_name(recording), recording.parent_path()};
    if (one.name != recording.stem().string()) one.above = one.above.parent_path();
    names.push_back(std::move(one));
  }
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    std::map<std::string, int> count;
    for (const Naming& one : names) ++count[one.name];
    for (Naming& one : names) {
      if (count[one.name] < 2 || one.above.filename().empty()) continue;
      one.name = one.above.filename().string() + "_" + one.name;
      one.above = one.above.parent_path();
      is_changed = true;
    }
  }
  std::vector<std::string> out;
  for (Naming& one : names) {
    // These names belong to what a task leaves besides its results.
    if (one.name.starts_with('.')) one.name.insert(0, "_");
    if (one.name.ends_with(".failed")) one.name += "_";
    out.push_back(std::move(one.name));
  }
  return out;
}

std::string with_drive(std::string text, const std::string& drive) {
  constexpr std::string_view kDrive = "{drive}";
  for (std::size_t at = 0; (at = text.find(kDrive, at)) != std::string::npos; at += drive.size())
    text.replace(at, kDrive.size(), drive);
  return text;
}

Result<FleetInput> read_once(InputRole role, const fs::path& file) {
  const auto opened = InputFile::open(file);
  if (!opened.ok()) return opened.error();
  auto hash = sha256_of(file);
  if (!hash.ok()) return hash.error();
  return FleetInput{role, file, opened->size(), std::move(*hash)};
}

/// Returns why the file may not hold a plan; empty if it may.
std::string wrong_name(const fs::path& file) {
  if (file.extension() != ".json" || file.stem().empty())
    return fmt::format(
        "{}: the name of a plan ends with .json; its results come into the folder of that name without it",
        file.string());
  return {};
}

Error refuse(const fs::path& file, const std::string& what) {
  return {ErrorCode::Malformed, fmt::format("{}: is no plan of this version: {}", file.string(), what)};
}

/// Reads the values of a plan and remembers the first one that is wrong.
class PlanReader {
 public:
  const std::string& wrong() const { return wrong_; }

  /// Returns the member; a null value if it is missing or `is_right` is not true of it.
  const Json& member(const Json& object, const char* key, const std::string& place, bool (*is_right)(const Json&),
                     const char* allowed) {
    static const Json kNull;
    const auto found = object.is_object() ? object.find(key) : object.end();
    if (object.is_object() && found != object.end() && is_right(*found)) return *found;
    if (wrong_.empty()) wrong_ = fmt::format("{}/{} is missing or not {}", place, key, allowed);
    return kNull;
  }
  std::string text(const Json& object, const char* key, const std::string& place) {
    const Json& value = member(
        object, key, place, [](const Json& one) { return one.is_string(); }, "a text");
    return value.is_string() ? value.get<std::string>() : std::string();
  }
  const Json& list(const Json& object, const char* key, const std::string& place) {
    return member(
        object, key, place, [](const Json& one) { return one.is_array() && !one.empty(); }, "a list of one or more");
  }
  std::uint64_t count(const Json& object, const char* key, const std::string& place) {
    const Json& value = member(
        object, key, place, [](const Json& one) { return one.is_number_unsigned(); }, "a number of bytes");
    return value.is_null() ? 0 : value.get<std::uint64_t>();
  }
  void refuse(const std::string& place, const std::string& what) {
    if (wrong_.empty()) wrong_ = place + " " + what;
  }

 private:
  std::string wrong_;
};

FleetInput input_of(PlanReader& reader, const Json& json, const std::string& place) {
  FleetInput out;
  const std::string word = reader.text(json, "role", place);
  const auto role = std::ranges::find_if(kRoles, [&](InputRole one) { return word == name(one); });
  if (role == kRoles.end())
    reader.refuse(place, "/role is not recording, rig, trajectory or trajectory_sigma");
  else
    out.role = *role;
  out.file = reader.text(json, "file", place);
  out.bytes = reader.count(json, "bytes", place);
  out.sha256 = reader.text(json, "sha256", place);
  if (!out.file.is_absolute() && !is_address(out.file))
    reader.refuse(place, "/file is not an absolute path, and no address of object storage");
  const bool is_hash = out.sha256.size() == 64 && out.sha256.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (!is_hash) reader.refuse(place, "/sha256 is not 64 hexadecimal digits");
  return out;
}

FleetTask task_of(PlanReader& reader, const Json& json, const std::string& place) {
  FleetTask out;
  out.name = reader.text(json, "name", place);
  // A folder beside the others, not a path to somewhere else.
  if (out.name.empty() || out.name.starts_with('.') || fs::path(out.name).filename() != out.name ||
      out.name.ends_with(".failed"))
    reader.refuse(place, "/name is not the name of a folder for results");
  std::set<InputRole> seen;
  for (const Json& input : reader.list(json, "inputs", place)) {
    out.inputs.push_back(input_of(reader, input, fmt::format("{}/inputs/{}", place, out.inputs.size())));
    const InputRole role = out.inputs.back().role;
    if (!seen.insert(role).second && role != InputRole::Recording)
      reader.refuse(place, fmt::format("/inputs has more than one {}", name(role)));
  }
  if (!out.inputs.empty() && out.inputs.front().role != InputRole::Recording)
    reader.refuse(place, "/inputs/0 is not a recording");
  if (seen.contains(InputRole::Trajectory)) {
    out.trajectory_time = reader.text(json, "trajectory_time", place);
    if (json.contains("trajectory_point")) out.trajectory_point = reader.text(json, "trajectory_point", place);
  }
  return out;
}

}  // namespace

const char* name(InputRole role) {
  switch (role) {
    case InputRole::Recording:
      return "recording";
    case InputRole::Rig:
      return "rig";
    case InputRole::Trajectory:
      return "trajectory";
    case InputRole::TrajectorySigma:
      return "trajectory_sigma";
  }
  return "?";
}

std::vector<std::string> FleetTask::options() const {
  std::vector<std::string> out;
  // As one word with its value: a value may begin with a minus sign.
  for (const FleetInput& input : inputs) switch (input.role) {
      case InputRole::Recording:
        break;
      case InputRole::Rig:
        out.push_back("--rig=" + input.file.string());
        break;
      case InputRole::Trajectory:
        out.push_back("--trajectory=" + input.file.string());
        break;
      case InputRole::TrajectorySigma:
        out.push_back("--trajectory-sigma=" + input.file.string());
        break;
    }
  if (!trajectory_time.empty()) out.push_back("--trajectory-time=" + trajectory_time);
  if (!trajectory_point.empty()) out.push_back("--trajectory-point=" + trajectory_point);
  return out;
}

fs::path FleetPlan::results() const { return file.parent_path() / file.stem(); }

Json FleetPlan::json() const {
  Json out = {{"hueline_plan", kFormat}, {"program", {{"version", version}, {"git_revision", git_revision}}}};
  Json& list = out["tasks"] = Json::array();
  for (const FleetTask& task : tasks) {
    Json one = {{"name", task.name}, {"inputs", Json::array()}};
    for (const FleetInput& input : task.inputs)
      one["inputs"].push_back({{"role", name(input.role)},
                               {"file", input.file.string()},
                               {"bytes", input.bytes},
                               {"sha256", input.sha256}});
    if (!task.trajectory_time.empty()) one["trajectory_time"] = task.trajectory_time;
    if (!task.trajectory_point.empty()) one["trajectory_point"] = task.trajectory_point;
    list.push_back(std::move(one));
  }
  return out;
}

Json question_of(const FleetPlan& plan, const FleetTask& task) {
  Json out = {{"program", {{"version", plan.version}, {"git_revision", plan.git_revision}}}, {"inputs", Json::array()}};
  for (const FleetInput& input : task.inputs)
    out["inputs"].push_back({{"role", name(input.role)}, {"bytes", input.bytes}, {"sha256", input.sha256}});
  out["trajectory_time"] = task.trajectory_time;
  out["trajectory_point"] = task.trajectory_point;
  return out;
}

Result<FleetPlan> make_plan(const FleetWish& wish, const fs::path& file) {
  FleetPlan plan{fs::absolute(file).lexically_normal(), runtime::kVersion, runtime::kGitRevision, {}};
  if (const std::string wrong = wrong_name(plan.file); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  if (wish.trajectory.empty() && !(wish.trajectory_sigma.empty() && wish.trajectory_point.empty()))
    return Error{ErrorCode::Invalid,
                 "--trajectory-sigma and --trajectory-point belong to --trajectory, which is missing"};
  std::vector<fs::path> recordings;
  std::set<fs::path> seen;
  for (const std::string& drive : wish.drives) {
    // "today/" names the same drive as "today".
    recordings.emplace_back(runtime::drive_file(absolute_name(drive).string()));
    if (!seen.insert(recordings.back()).second)
      return Error{ErrorCode::Invalid, fmt::format("{} is named twice", recordings.back().string())};
  }
  const std::vector<std::string> names = names_of(recordings);
  std::map<fs::path, Result<FleetInput>> known;  // files that many tasks read, such as a rig
  std::string unreadable;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    FleetTask task{names[i], {}, {}, {}};
    if (std::ranges::count(names, task.name) > 1)
      return Error{ErrorCode::Invalid, fmt::format("two drives have the name {}: rename one", task.name)};
    const auto add = [&](InputRole role, const fs::path& path) {
      if (printable(path.string()) != path.string())
        return Status(Error{ErrorCode::Invalid,
                            printable(path.string()) + ": its name has signs that are not text (UTF-8); rename it"});
      auto found = known.find(path);
      if (found == known.end() || role == InputRole::Recording)
        found = known.insert_or_assign(path, read_once(role, path)).first;
      if (!found->second.ok()) {
        const std::string line = fmt::format("{}: {}", task.name, found->second.error().message);
        unreadable += (unreadable.empty() ? "" : "\n") + line;
        return Status();
      }
      task.inputs.push_back(*found->second);
      task.inputs.back().role = role;
      return Status();
    };
    std::vector<std::pair<InputRole, fs::path>> files;
    const auto segments = storage::find_segments(recordings[i]);
    if (!segments.ok()) {
      unreadable += fmt::format("{}{}: {}", unreadable.empty() ? "" : "\n", task.name, segments.error().message);
      continue;
    }
    for (const storage::Segment& segment : *segments) files.emplace_back(InputRole::Recording, segment.path);
    const std::pair<InputRole, const std::string&> named[] = {{InputRole::Rig, wish.rig},
                                                              {InputRole::Trajectory, wish.trajectory},
                                                              {InputRole::TrajectorySigma, wish.trajectory_sigma}};
    for (const auto& [role, text] : named)
      if (!text.empty()) files.emplace_back(role, absolute_name(with_drive(text, task.name)));
    for (const auto& [role, path] : files)
      if (const Status added = add(role, path); !added.ok()) return added.error();
    if (!wish.trajectory.empty()) {
      task.trajectory_time = wish.trajectory_time;
      task.trajectory_point = wish.trajectory_point;
    }
    log_info("{} of {}: {}", i + 1, recordings.size(), task.name);
    plan.tasks.push_back(std::move(task));
  }
  if (!unreadable.empty()) return Error{ErrorCode::Io, unreadable};
  return plan;
}

Result<FleetPlan> read_plan(const fs::path& file) {
  const auto text = read_input(file, kLargestPlan, "a plan");
  if (!text.ok()) return text.error();
  const Json root = Json::parse(*text, nullptr, false);
  if (root.is_discarded()) return refuse(file, "it is not JSON");
  if (!root.is_object() || root.value("hueline_plan", Json()) != kFormat)
    return refuse(file, fmt::format("/hueline_plan is not {}", kFormat));
  FleetPlan plan;
  plan.file = fs::absolute(file).lexically_normal();
  if (const std::string wrong = wrong_name(plan.file); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  PlanReader reader;
  const Json& program = reader.member(
      root, "program", "", [](const Json& one) { return one.is_object(); }, "an object");
  plan.version = reader.text(program, "version", "/program");
  plan.git_revision = reader.text(program, "git_revision", "/program");
  std::set<std::string> names;
  for (const Json& task : reader.list(root, "tasks", "")) {
    const std::string place = fmt::format("/tasks/{}", plan.tasks.size());
    plan.tasks.push_back(task_of(reader, task, place));
    if (!names.insert(plan.tasks.back().name).second) reader.refuse(place, "/name is that of another task");
    if (!reader.wrong().empty()) break;
  }
  if (!reader.wrong().empty()) return refuse(file, printable(reader.wrong()));
  return plan;
}

}  // namespace hueline::apps
