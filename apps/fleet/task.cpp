#include "apps/fleet/task.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "apps/exit_code.hpp"
#include "apps/fleet/json_file.hpp"
#include "apps/log.hpp"
#include "apps/sha256.hpp"
#include "core/child.hpp"
#include "core/input_file.hpp"
#include "core/json_text.hpp"
#include "core/output_file.hpp"
#include "core/printable.hpp"
#include "runtime/version.hpp"

namespace hueline::apps {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr const char *kResult = "result.json", *kLog = "log.txt", *kSummary = "summary.json";

struct EndWords {
  TaskEnd end;
  const char *name, *words;
  int status;
};
constexpr std::array kEnds{
    EndWords{TaskEnd::Done, "done", "done", kDone},
    EndWords{TaskEnd::Damaged, "damaged", "an input is damaged; the results are those of what is whole",
             kInputUnreadable},
    EndWords{TaskEnd::Empty, "empty", "no point could be made", kNothingCame},
    EndWords{TaskEnd::InputChanged, "input_changed", "an input is not what it was when the plan was made",
             kInputUnreadable},
    EndWords{TaskEnd::InputMissing, "input_missing", "an input cannot be read", kInputUnreadable},
    EndWords{TaskEnd::OtherProgram, "other_program", "another version of the program made the plan", kWrongUse},
    EndWords{TaskEnd::Refused, "refused", "the rig or the trajectory does not fit the drive", kWrongUse},
    EndWords{TaskEnd::OutputRefused, "output_refused", "the results could not be written", kOutputRefused},
    EndWords{TaskEnd::Crashed, "crashed", "a signal ended the replay", kFailed},
    EndWords{TaskEnd::Stopped, "stopped", "stopped before its end", kStopped},
    EndWords{TaskEnd::Failed, "failed", "the replay failed", kFailed},
};
const EndWords& words_of(TaskEnd end) {
  return *std::ranges::find_if(kEnds, [&](const EndWords& one) { return one.end == end; });
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? printable(name.data()) : "?";
}

bool stays_in_its_folder(const fs::path& file) {
  return !file.empty() && file.is_relative() && file.lexically_normal() == file && *file.begin() != "..";
}

/// Reads a result.json. Returns nothing if it is none.
std::optional<TaskResult> result_of(const Json& root) {
  TaskResult out;
  const std::string word = text_at(root, "/status");
  const auto end = std::ranges::find_if(kEnds, [&](const EndWords& one) { return word == one.name; });
  if (end == kEnds.end()) return {};
  out.end = end->end;
  out.text = text_at(root, "/text");
  out.verdict = text_at(root, "/verdict");
  out.host = text_at(root, "/host");
  out.seconds = number_at(root, "/seconds").value_or(out.seconds);
  const auto products = root.find("products");
  if (products == root.end() || !products->is_object()) return out;
  for (const auto& [file, product] : products->items()) {
    const auto bytes = product.find("bytes");
    if (!stays_in_its_folder(file) || bytes == product.end() || !bytes->is_number_unsigned()) return {};
    out.products[file] = {bytes->get<std::uint64_t>(), text_at(product, "/sha256")};
  }
  return out;
}

/// Returns what is wrong with the inputs: an end and its reason.
std::optional<TaskResult> wrong_inputs(const FleetTask& task, const std::stop_token& stop) {
  const auto wrong = [](TaskEnd end, std::string text) {
    TaskResult out;
    out.end = end;
    out.text = std::move(text);
    return out;
  };
  for (const FleetInput& input : task.inputs) {
    const auto hash = sha256_of(input.file, stop);
    if (!hash.ok())
      return wrong(hash.error().code == ErrorCode::Stopped ? TaskEnd::Stopped : TaskEnd::InputMissing,
                   hash.error().message);
    if (*hash != input.sha256)
      return wrong(TaskEnd::InputChanged,
                   fmt::format("{}: its SHA-256 is {}, and was {} when the plan was made; restore the file, or make "
                               "another plan",
                               input.file.string(), *hash, input.sha256));
  }
  return {};
}

TaskEnd end_of(int status) {
  switch (status) {
    case kDone:
    case kDriveAgain:  // the replay has done its work; the verdict says the rest
      return TaskEnd::Done;
    case kWrongUse:
      return TaskEnd::Refused;
    case kInputUnreadable:
      return TaskEnd::Damaged;
    case kOutputRefused:
      return TaskEnd::OutputRefused;
    case kNothingCame:
      return TaskEnd::Empty;
    case kStopped:
      return TaskEnd::Stopped;
    default:
      return status > 128 ? TaskEnd::Crashed : TaskEnd::Failed;
  }
}

/// Returns the last error in a log, in one line; the last lines if it has none. `is_whole`: the replay has not crashed,
/// so that what it prints after its error is no part of it.
std::string last_words(const fs::path& log, bool is_whole) {
  constexpr std::string_view kError = " error ";
  std::string text = last_lines(log, 2000);
  while (text.ends_with('\n')) text.pop_back();
  if (const auto at = text.rfind(kError); at != std::string::npos) {
    text.erase(0, at + kError.size());
    if (is_whole) text.erase(std::min(text.size(), text.find('\n')));
  }
  return printable(text);
}

/// Describes every file of the folder, and of the folder of the cloud's parts in it.
Status describe_products(const fs::path& folder, std::map<std::string, FleetProduct>& products) {
  std::error_code failed;
  for (fs::recursive_directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (!at->is_regular_file()) continue;
    auto hash = sha256_of(at->path());
    if (!hash.ok()) return hash.error();
    products[at->path().lexically_relative(folder).string()] = {at->file_size(), std::move(*hash)};
  }
  if (failed) return io_error("list " + folder.string(), failed.value());
  return {};
}

Status move_to(const fs::path& from, const fs::path& to) {
  std::error_code failed;
  fs::rename(from, to, failed);
  return failed ? Status(output_error(fmt::format("rename {} to {}", from.string(), to.string()), failed.value()))
                : Status();
}

/// Returns how the names of the folders begin in which attempts at this task work.
std::string attempt_prefix(const FleetTask& task) { return "." + task.name + ".attempt."; }

/// Removes what killed attempts at the task have left: folders that nobody holds. That of a killed program whose replay
/// still writes remains until the next time.
void remove_dead_attempts(const FleetPlan& plan, const FleetTask& task) {
  const std::string prefix = attempt_prefix(task);
  std::error_code ignored;
  for (fs::directory_iterator at(plan.results(), ignored), end; !ignored && at != end; at.increment(ignored)) {
    if (!at->path().filename().string().starts_with(prefix)) continue;
    const auto folder = OutputFolder::open(at->path());
    if (!folder.ok()) continue;
    const auto drive = OutputFolder::open(at->path() / "drive");
    std::error_code unknown;
    if (drive.ok()) fs::remove_all(at->path(), unknown);
  }
}

/// The folder in which one attempt at a task works. Its name begins with a full stop, so neither people nor programs
/// take it for results. The destructor removes it.
class Attempt {
 public:
  static Result<Attempt> begin(const FleetPlan& plan, const FleetTask& task) {
    static std::atomic<unsigned> count{0};
    const std::string unique = fmt::format("{}.{}.{}", host_name(), ::getpid(), ++count);
    // It gets its name when it is held: others would take it for a dead one before.
    const fs::path first = plan.results() / (".begin." + unique);
    auto folder = OutputFolder::open(first);
    if (!folder.ok()) return folder.error();
    // The replay holds the drive's folder, and this program the one above it.
    Attempt out(std::move(*folder), plan.results() / (attempt_prefix(task) + unique));
    std::error_code failed;
    fs::create_directory(first / "drive", failed);
    if (failed) return output_error("make folder " + first.string(), failed.value());
    if (const Status named = move_to(first, out.path_); !named.ok()) return named.error();
    return out;
  }
  Attempt(Attempt&& other) noexcept = default;
  Attempt& operator=(Attempt&&) = delete;
  ~Attempt() {
    if (!folder_) return;
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }

  fs::path drive() const { return path_ / "drive"; }
  fs::path log() const { return path_ / kLog; }
  fs::path old() const { return path_ / "old"; }

 private:
  Attempt(OutputFolder folder, fs::path path)
      : folder_(std::make_unique<OutputFolder>(std::move(folder))), path_(std::move(path)) {}

  std::unique_ptr<OutputFolder> folder_;  // held until it is removed
  fs::path path_;
};

/// Replays the drive into the attempt's folder.
TaskResult replay_drive(const FleetTask& task, const Attempt& attempt, const Replayer& replay,
                        const std::stop_token& stop) {
  TaskResult out;
  std::vector<std::string> words{task.recording().string(), "--out", attempt.drive().string(), "--no-feed"};
  for (std::string& word : task.options()) words.push_back(std::move(word));
  const auto status = replay(words, attempt.log(), stop);
  if (!status.ok()) {
    out.text = status.error().message;
    return out;
  }
  out.end = end_of(*status);
  if (stop.stop_requested() && !has_results(out.end)) out.end = TaskEnd::Stopped;
  if (out.end != TaskEnd::Done) out.text = last_words(attempt.log(), out.end != TaskEnd::Crashed);
  if (out.end == TaskEnd::Crashed) out.text = fmt::format("signal {}; {}", *status - 128, out.text);
  if (!has_results(out.end)) return out;
  // A recording that cannot be opened at all gives the same status as one that is read in part.
  const auto summary = read_json(attempt.drive() / kSummary, "a result");
  if (!summary.ok()) {
    out.text = out.end == TaskEnd::Done ? summary.error().message : out.text;
    out.end = out.end == TaskEnd::Done ? TaskEnd::Failed : TaskEnd::InputMissing;
    return out;
  }
  // What a disk or a network did not give is not damaged, and may come the next time.
  if (out.end == TaskEnd::Damaged && summary->contains("ends_early")) {
    out.end = TaskEnd::InputMissing;
    return out;
  }
  out.verdict = text_at(*summary, "/verdict/grade");
  if (const Status read = describe_products(attempt.drive(), out.products); !read.ok()) {
    out.end = TaskEnd::OutputRefused;
    out.text = read.error().message;
  }
  return out;
}

/// Writes result.json and the log into the drive's folder, and gives it the name at which others look for it.
Status publish(const Attempt& attempt, const TaskResult& result, const Json& question, const fs::path& place) {
  std::error_code failed;
  fs::create_directories(attempt.drive(), failed);
  if (failed) return output_error("make folder " + attempt.drive().string(), failed.value());
  if (fs::exists(attempt.log(), failed))
    if (const Status moved = move_to(attempt.log(), attempt.drive() / kLog); !moved.ok()) return moved;
  const std::string text = json_text(result.json(question), 2) + "\n";
  if (const Status written = write_output(attempt.drive() / kResult, text); !written.ok()) return written;
  // A folder takes the place of none or of an empty one. What is there is put aside first; another attempt at the same
  // task may do both at the same time, so that the place is taken or empty again between two steps of this one.
  constexpr int kTries = 100;
  for (int tries = 1;; ++tries) {
    fs::rename(attempt.drive(), place, failed);
    if (!failed) return {};
    const bool is_taken = failed == std::errc::directory_not_empty || failed == std::errc::file_exists;
    if (!is_taken || tries == kTries)
      return output_error(fmt::format("rename {} to {}", attempt.drive().string(), place.string()), failed.value());
    fs::remove_all(attempt.old(), failed);
    fs::rename(place, attempt.old(), failed);
    if (failed && failed != std::errc::no_such_file_or_directory)
      return output_error(fmt::format("rename {} to {}", place.string(), attempt.old().string()), failed.value());
  }
}

}  // namespace

const char* name(TaskEnd end) { return words_of(end).name; }
const char* words(TaskEnd end) { return words_of(end).words; }
int exit_status(TaskEnd end) { return words_of(end).status; }
bool has_results(TaskEnd end) { return end == TaskEnd::Done || end == TaskEnd::Damaged || end == TaskEnd::Empty; }

Json TaskResult::json(const Json& question) const {
  Json out = {{"status", name(end)}, {"exit_status", exit_status(end)},
              {"text", text},        {"verdict", verdict},
              {"host", host},        {"seconds", seconds},
              {"question", question}};
  out["products"] = Json::object();
  for (const auto& [file, product] : products)
    out["products"][file] = {{"bytes", product.bytes}, {"sha256", product.sha256}};
  return out;
}

fs::path results_of(const FleetPlan& plan, const FleetTask& task) { return plan.results() / task.name; }
fs::path failure_of(const FleetPlan& plan, const FleetTask& task) { return plan.results() / (task.name + ".failed"); }

std::optional<TaskResult> finished_result(const FleetPlan& plan, const FleetTask& task, Check check, std::string* why) {
  const auto no = [&](std::string reason) {
    if (why != nullptr) *why = std::move(reason);
    return std::optional<TaskResult>();
  };
  const fs::path folder = results_of(plan, task);
  std::error_code unknown;
  // An engine may make an empty folder before it starts the task.
  if (!fs::exists(folder, unknown) || fs::is_empty(folder, unknown)) return no({});
  const auto root = read_json(folder / kResult, "a result");
  if (!root.ok()) return no(root.error().message);
  std::optional<TaskResult> out = result_of(*root);
  if (!out || !has_results(out->end)) return no((folder / kResult).string() + ": is no result");
  const auto question = root->find("question");
  if (question == root->end() || *question != question_of(plan, task))
    return no(folder.string() + ": has the results of other inputs, options or another program");
  for (const auto& [file, product] : out->products) {
    if (const auto bytes = fs::file_size(folder / file, unknown); unknown || bytes != product.bytes)
      return no((folder / file).string() + ": is not as long as it was written");
    if (check == Check::Sizes) continue;
    const auto hash = sha256_of(folder / file);
    if (!hash.ok()) return no(hash.error().message);
    if (*hash != product.sha256) return no((folder / file).string() + ": is not what was written");
  }
  return out;
}

std::optional<TaskResult> failed_result(const FleetPlan& plan, const FleetTask& task) {
  const auto root = read_json(failure_of(plan, task) / kResult, "a result");
  if (!root.ok()) return {};
  const auto question = root->find("question");
  if (question == root->end() || *question != question_of(plan, task)) return {};
  std::optional<TaskResult> out = result_of(*root);
  return out && !has_results(out->end) ? out : std::nullopt;
}

Replayer hueline_replayer(int threads) {
  return [threads](const std::vector<std::string>& words, const fs::path& log,
                   const std::stop_token& stop) -> Result<int> {
    std::vector<std::string> all{program_beside_this("hueline").string(), "replay"};
    all.insert(all.end(), words.begin(), words.end());
    all.push_back(fmt::format("--threads={}", threads));
    auto child = Child::start(all, log, {}, Child::Session::Parents);
    if (!child.ok()) return child.error();
    for (bool is_asked = false;;) {
      if (const auto status = child->take_end()) return *status;
      if (stop.stop_requested() && !std::exchange(is_asked, true)) child->ask_to_end();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  };
}

Result<TaskResult> do_task(const FleetPlan& plan, const FleetTask& task, const Replayer& replay,
                           const std::stop_token& stop, bool* is_new) {
  if (is_new != nullptr) *is_new = false;
  remove_dead_attempts(plan, task);
  std::string why;
  if (auto done = finished_result(plan, task, Check::Digests, &why)) return std::move(*done);
  if (!why.empty()) log_warning("{}; the task is done again", why);
  if (is_new != nullptr) *is_new = true;
  const auto begin = std::chrono::steady_clock::now();
  auto attempt = Attempt::begin(plan, task);
  if (!attempt.ok()) return attempt.error();
  TaskResult result;
  if (plan.version != runtime::kVersion || plan.git_revision != runtime::kGitRevision) {
    result.end = TaskEnd::OtherProgram;
    result.text = fmt::format("the plan was made by {} ({}), and this is {} ({}): use that one, or make another plan",
                              plan.version, plan.git_revision, runtime::kVersion, runtime::kGitRevision);
  } else if (auto wrong = wrong_inputs(task, stop)) {
    result = std::move(*wrong);
  } else {
    result = replay_drive(task, *attempt, replay, stop);
  }
  result.host = host_name();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::error_code ignored;
  // Somebody who stops a task wants to go on later: that is no failure to be told.
  if (result.end == TaskEnd::Stopped) return result;
  const Json question = question_of(plan, task);
  if (has_results(result.end)) {
    // Another attempt at the same task may have been faster.
    if (auto done = finished_result(plan, task, Check::Digests)) return std::move(*done);
    const Status published = publish(*attempt, result, question, results_of(plan, task));
    if (published.ok()) {
      fs::remove_all(failure_of(plan, task), ignored);
      return result;
    }
    if (auto done = finished_result(plan, task, Check::Digests)) return std::move(*done);
    result.end = TaskEnd::OutputRefused;
    result.text = published.error().message;
  }
  result.verdict.clear();
  result.products.clear();
  fs::remove_all(attempt->drive(), ignored);
  fs::remove_all(attempt->old(), ignored);
  if (const Status written = publish(*attempt, result, question, failure_of(plan, task)); !written.ok())
    log_error("{}", written.error().message);
  return result;
}

}  // namespace hueline::apps
