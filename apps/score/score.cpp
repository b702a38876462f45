#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/progress_bar.hpp"
#include "apps/score/score_drive.hpp"
#include "apps/score/score_output.hpp"
#include "apps/score/score_scenario.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"
#include "config/sheet.hpp"
#include "core/input_folder.hpp"
#include "runtime/recording.hpp"
#include "runtime/version.hpp"
#include "score/metric_table.hpp"
#include "score/sheet_text.hpp"

namespace hueline::apps {
namespace {

struct ScoreOptions {
  std::string sheet = "quick", out, cache, against, sights;
  std::string recording, rig;
  int threads = 0;
};

int threads_of(const ScoreOptions& options) {
  return options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// Returns the name of the processor and its number of threads. Wall-clock figures need it to mean anything.
std::string machine() {
  std::ifstream cpus("/proc/cpuinfo");
  for (std::string line; std::getline(cpus, line);)
    if (line.starts_with("model name"))
      return fmt::format("{} x {}", std::thread::hardware_concurrency(),
                         line.substr(std::min(line.size(), line.find(':') + 2)));
  return fmt::format("{} threads", std::thread::hardware_concurrency());
}

/// Returns the name of a metric that differs between two runs of one scenario, or an empty text.
std::string first_difference(const ScoredRun& a, const ScoredRun& b) {
  if (a.cloud != b.cloud) return "the cloud";
  for (const score::Metric& metric : score::metrics()) {
    if (metric.is_wall_clock) continue;
    if (a.score.figures.at(metric.name).value != b.score.figures.at(metric.name).value) return metric.name;
  }
  return {};
}

/// Reads the figures of another version, if there are any.
Result<score::Sheet> read_before(const ScoreOptions& options) {
  return options.against.empty() ? score::Sheet() : score::read_score_json(options.against);
}

/// Prints and writes the results, and returns the exit status of a run whose input was read.
int finish(const ScoreOptions& options, const score::Sheet& before, const score::Sheet& sheet, score::RunNotes notes,
           std::chrono::steady_clock::time_point began) {
  const auto changes = options.against.empty() ? std::vector<score::Change>() : score::compare(before, sheet);
  notes.revision = fmt::format("hueline {} ({})", runtime::kVersion, runtime::kGitRevision);
  notes.machine = machine();
  notes.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  std::fputs((score::terminal_table(sheet) + "\n" + notes.determinism + "\n").c_str(), stdout);
  if (!changes.empty())
    std::fputs(("\nagainst " + options.against + "\n" + score::terminal_changes(changes)).c_str(), stdout);
  if (const Status written = write_score(options.out, sheet, notes, changes); !written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  std::fputs(fmt::format("\n{} s; look at {}/score.html\n", static_cast<int>(notes.wall_s), options.out).c_str(),
             stdout);
  const bool is_worse = std::any_of(changes.begin(), changes.end(),
                                    [](const score::Change& c) { return c.verdict == score::Verdict::Worse; });
  return is_worse || !notes.is_deterministic ? kNotAsExpected : kDone;
}

/// Returns the name of a drive: that of its folder, or of the file if it is not called drive.mcap.
std::string name_of_drive(const std::string& recording) {
  const std::filesystem::path file = absolute_name(runtime::drive_file(recording));
  return file.filename() == "drive.mcap" ? file.parent_path().filename().string() : file.stem().string();
}

int run_recording(const ScoreOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  const auto before = read_before(options);
  if (!before.ok()) {
    log_error(before.error().message);
    return kInputUnreadable;
  }
  DriveOptions drive;
  drive.recording = options.recording;
  drive.rig = options.rig;
  ProgressBar bar;
  auto source = DriveSource::open(drive, bar);
  if (!source.ok()) {
    log_error(source.error().message);
    return opening_status(source.error());
  }
  const ScoredDrive scored = score_drive(*source, name_of_drive(options.recording), threads_of(options), bar);
  bar.end();
  if (!scored.read.ok()) log_warning(scored.read.error().message);
  score::RunNotes notes;
  notes.command = fmt::format("hueline score --recording {}", options.recording);
  notes.determinism = "the recording was read once; there is no truth, so that only some of the figures have a value";
  const int status = finish(options, *before, {scored.score}, notes, began);
  if (status == kDone && std::none_of(scored.score.figures.begin(), scored.score.figures.end(),
                                      [](const auto& figure) { return figure.second.value.has_value(); })) {
    log_error("no point of the recording could be seen in an image of it; hueline replay says what is missing");
    return kNothingCame;
  }
  return status == kDone && !scored.read.ok() ? kInputUnreadable : status;
}

int run_sheet(const ScoreOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  const config::Sheet plan = config::load_sheet(options.sheet);
  const auto before = read_before(options);
  if (!before.ok()) {
    log_error(before.error().message);
    return kInputUnreadable;
  }
  // All files are read before the first drive, so that a typing error shows at once.
  std::vector<sim::Scenario> scenarios;
  for (const auto& file : plan.scenarios) scenarios.push_back(config::load_scenario(file.string()));

  const int threads = threads_of(options);
  const std::string cache = options.cache.empty() ? options.out + "/drives" : options.cache;
  ProgressBar bar;
  const ScoreProgress progress = [&](const std::string& stage, double share) { bar.show(stage, share); };
  score::Sheet sheet;
  score::RunNotes notes;
  // A folder that cannot be made is told when the first table is written.
  std::error_code ignored;
  if (!options.sights.empty()) std::filesystem::create_directories(options.sights, ignored);
  for (std::size_t i = 0; i < scenarios.size(); ++i) {
    const std::string name = plan.scenarios[i].stem().string();
    const std::string sights = options.sights.empty() ? std::string() : options.sights + "/" + name + ".csv";
    auto scored = score_scenario(scenarios[i], name, cache, plan.ray_returns, threads, progress, sights);
    if (scored.ok() && i == 0) {
      // Runs one scenario twice. The cloud and all figures must not depend on the number of threads.
      const int other = threads == 1 ? 2 : 1;
      const auto again = score_scenario(scenarios[i], name, cache, plan.ray_returns, other, progress);
      if (!again.ok()) {
        scored = again.error();
      } else {
        const std::string difference = first_difference(*scored, *again);
        notes.is_deterministic = difference.empty();
        notes.determinism =
            notes.is_deterministic
                ? fmt::format(
                      "deterministic: {} with {} and {} threads gave the same {} points ({:016x}{:016x}) and the same "
                      "figures",
                      name, threads, other, scored->cloud.points(), scored->cloud.value()[0], scored->cloud.value()[1])
                : fmt::format("NOT deterministic: {} of {} differs between {} and {} threads", difference, name,
                              threads, other);
      }
    }
    if (!scored.ok()) {
      bar.end();
      log_error("{}: {}", name, scored.error().message);
      return kInputUnreadable;
    }
    sheet.push_back(std::move(scored->score));
  }
  bar.end();
  notes.command = fmt::format("hueline score --sheet {}", options.sheet);
  return finish(options, *before, sheet, std::move(notes), began);
}

}  // namespace

void add_score(Command& all) {
  auto options = std::make_shared<ScoreOptions>();
  Command command = all.command(kScore.word, kScore.help);
  command.setting("--sheet", options->sheet,
                  "quick or full, which are installed with the program, or the file of another sheet");
  command.option("--recording", options->recording,
                 "a recording (drive.mcap) instead of a sheet: the figures that need no truth");
  command.option("--rig", options->rig, "with --recording: another rig instead of the recorded one");
  command.required("--out", options->out, "folder for score.json, score_notes.json and score.html");
  command.option("--cache", options->cache,
                 "folder of rendered drives, which are used again for the same scenario; default: OUT/drives");
  command.option(
      "--against", options->against,
      "score.json of another version: prints what is better or worse beyond noise; exit status 6 if anything is worse");
  command.option(
      "--sights", options->sights,
      "folder for a table of each scenario: the lines of sight that were judged, and whether they truly were "
      "free (docs/methods/visibility.md)");
  command.setting("--threads", options->threads, "threads of rendering and colouring; 0: as many as the computer has",
                  {0, 256});
  command.reads(options->sheet).reads(options->against).reads(options->recording).reads(options->rig);
  command.writes_into(options->out).writes_into(options->sights);
  command.footer(
      "Example: hueline score --sheet quick --out out/score --against docs/score/quick.json\n"
      "Exit status: 0; 3 if an input cannot be read; 6 if a figure is worse than that of --against.\n"
      "More: docs/score.md");
  command.runs([options] {
    if (options->recording.empty() && !options->rig.empty())
      throw config::ConfigError("--rig is the rig of a recording: give --recording too");
    return options->recording.empty() ? run_sheet(*options) : run_recording(*options);
  });
}

}  // namespace hueline::apps
