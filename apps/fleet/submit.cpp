#include "apps/fleet/submit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "apps/exit_code.hpp"
#include "apps/fleet/task.hpp"
#include "apps/log.hpp"
#include "core/child.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

namespace fs = std::filesystem;

/// Returns the text as one word of a shell.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char sign : text) sign == '\'' ? out += "'\\''" : out += sign;
  return out + "'";
}

bool is_plain_word(const std::string& text) {
  return std::ranges::all_of(text, [](char sign) {
    return std::isalnum(static_cast<unsigned char>(sign)) != 0 ||
           std::string_view("-_:.,+@").find(sign) != std::string_view::npos;
  });
}

/// Returns the text as a name of a job: schedulers show it, and want plain signs.
std::string plain(std::string text) {
  for (char& sign : text)
    if (!is_plain_word({sign})) sign = '_';
  return text;
}

/// Makes the folder of an engine's files. Returns an error's exit status, or kDone.
int make_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (!failed) return kDone;
  log_error("{}", output_error("make folder " + folder.string(), failed.value()).message);
  return kOutputRefused;
}

int write_script(const fs::path& file, const std::string& text) {
  const Status written = write_output(file, text);
  if (written.ok()) return kDone;
  log_error("{}", written.error().message);
  return kOutputRefused;
}

/// Gives a script to sbatch and waits for its answer, which is printed.
int call_sbatch(const SubmitWish& wish, const fs::path& script) {
  std::vector<std::string> words{"/usr/bin/env", "sbatch"};
  words.insert(words.end(), wish.further.begin(), wish.further.end());
  words.push_back(script.string());
  const fs::path said = script.string() + ".txt";
  auto child = Child::start(words, said, {}, Child::Session::Parents);
  if (!child.ok()) {
    log_error("{}", child.error().message);
    return kFailed;
  }
  std::optional<int> status;
  while (!(status = child->take_end())) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const std::string text = last_lines(said, 4000);
  if (*status == 0) {
    std::fputs(text.c_str(), stdout);
    return kDone;
  }
  log_error("sbatch ended with status {}: {}{}", *status, text,
            *status == 127 ? "; is Slurm installed on this computer? --only-write writes the script alone" : "");
  return kFailed;
}

}  // namespace

fs::path engine_folder(const FleetPlan& plan, const std::string& engine) { return plan.results() / ("." + engine); }

Result<std::string> slurm_script(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish,
                                 const fs::path& hueline) {
  std::string out = fmt::format(
      "#!/bin/bash\n"
      "# Written by `hueline fleet submit`: {} drives of {}.\n"
      "#SBATCH --job-name={}\n"
      "#SBATCH --array=0-{}",
      tasks.size(), quoted(plan.file.filename().string()), plain("hueline-" + plan.file.stem().string()),
      tasks.size() - 1);
  if (wish.at_once > 0) out += fmt::format("%{}", wish.at_once);
  out += "\n";
  const std::pair<const char*, const std::string&> options[] = {
      {"partition", wish.partition}, {"time", wish.time}, {"mem", wish.memory}};
  for (const auto& [word, value] : options) {
    if (value.empty()) continue;
    if (!is_plain_word(value))
      return Error{ErrorCode::Invalid, fmt::format("--{} '{}': allowed are letters, digits and -_:.,+@", word, value)};
    out += fmt::format("#SBATCH --{}={}\n", word, value);
  }
  const std::string logs = (engine_folder(plan, "slurm") / "").string();
  if (logs.find_first_of("\"\\%") != std::string::npos)
    return Error{ErrorCode::Invalid,
                 fmt::format("{}: a script of Slurm cannot name a folder with \", \\ or %; rename it", logs)};
  out += fmt::format(
      "#SBATCH --ntasks=1\n"
      "#SBATCH --cpus-per-task={}\n"
      "# A task that was killed has left nothing; done again, it gives the same bytes.\n"
      "#SBATCH --requeue\n"
      "#SBATCH --open-mode=append\n"
      "#SBATCH --output=\"{}%A_%a.txt\"\n"
      "tasks=({})\n"
      "exec {} fleet task {} \"${{tasks[SLURM_ARRAY_TASK_ID]}}\" --threads={}\n",
      wish.threads, logs, fmt::join(tasks, " "), quoted(hueline.string()), quoted(plan.file.string()), wish.threads);
  return out;
}

std::string snakefile(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish,
                      const fs::path& hueline) {
  // The texts of JSON are texts of Python too.
  const auto text = [](const std::string& value) { return nlohmann::json(value).dump(); };
  return fmt::format(
      "# Written by `hueline fleet submit --engine snakemake`.\n"
      "workdir: {}\n"
      "\n"
      "rule all:\n"
      "    input:\n"
      "        expand(\"{{number}}.done\", number=[{}])\n"
      "\n"
      "rule drive:\n"
      "    output:\n"
      "        touch(\"{{number}}.done\")\n"
      "    params:\n"
      "        hueline={},\n"
      "        plan={}\n"
      "    threads: {}\n"
      "    shell:\n"
      "        \"{{params.hueline:q}} fleet task {{params.plan:q}} {{wildcards.number}} --threads={{threads}}\"\n",
      text(engine_folder(plan, "snakemake").string()), fmt::join(tasks, ", "), text(hueline.string()),
      text(plan.file.string()), wish.threads);
}

int submit_to_slurm(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish,
                    bool only_write) {
  const fs::path folder = engine_folder(plan, "slurm");
  if (const int made = make_folder(folder); made != kDone) return made;
  for (std::size_t begin = 0; begin < tasks.size(); begin += kMostArrayTasks) {
    const auto first = tasks.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = tasks.begin() + static_cast<std::ptrdiff_t>(std::min(begin + kMostArrayTasks, tasks.size()));
    const auto script = slurm_script(plan, {first, last}, wish, program_beside_this("hueline"));
    if (!script.ok()) {
      log_error("{}", script.error().message);
      return kWrongUse;
    }
    const fs::path file = folder / fmt::format("array{}.sh", begin / kMostArrayTasks + 1);
    if (const int written = write_script(file, *script); written != kDone) return written;
    if (only_write)
      fmt::print("{}\n", file.string());
    else if (const int called = call_sbatch(wish, file); called != kDone)
      return called;
  }
  return kDone;
}

int write_snakefile(const FleetPlan& plan, const std::vector<std::size_t>& tasks, const SubmitWish& wish) {
  const fs::path folder = engine_folder(plan, "snakemake");
  if (const int made = make_folder(folder); made != kDone) return made;
  // Snakemake would take the marks of an earlier time for results.
  std::error_code ignored;
  for (const std::size_t number : tasks) fs::remove(folder / fmt::format("{}.done", number), ignored);
  const fs::path file = folder / "Snakefile";
  if (const int written = write_script(file, snakefile(plan, tasks, wish, program_beside_this("hueline")));
      written != kDone)
    return written;
  fmt::print("snakemake --snakefile {} --keep-going --cores all\n", quoted(file.string()));
  return kDone;
}

}  // namespace hueline::apps
