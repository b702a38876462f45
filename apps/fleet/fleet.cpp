#include "apps/fleet/fleet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/fleet/catalogue.hpp"
#include "apps/fleet/catalogue_output.hpp"
#include "apps/fleet/postgres.hpp"
#include "apps/fleet/state.hpp"
#include "apps/fleet/submit.hpp"
#include "apps/fleet/upload.hpp"
#include "apps/log.hpp"
#include "apps/signals.hpp"
#include "core/number_word.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

constexpr const char* kThreadsHelp = "number of colouring threads of each replay; it does not change the results";

std::string number_of(std::size_t drives) { return fmt::format("{} drive{}", drives, drives == 1 ? "" : "s"); }

/// Calls `use` with the plan. Returns what `use` returns, or the exit status of a plan that cannot be read.
template <class Use>
int with_plan(const std::string& file, const Use& use) {
  const auto plan = read_plan(file);
  if (plan.ok()) return use(*plan);
  log_error("{}", plan.error().message);
  return opening_status(plan.error());
}

int plan_fleet(const FleetWish& wish, const std::string& out) {
  const auto plan = make_plan(wish, out);
  if (!plan.ok()) {
    log_error("{}", plan.error().message);
    return opening_status(plan.error());
  }
  if (const Status written = write_output(out, plan->json().dump(2) + "\n"); !written.ok()) {
    log_error("{}", written.error().message);
    return kOutputRefused;
  }
  fmt::print("{0}; `hueline fleet run {1}` fuses into {2}\n", number_of(plan->tasks.size()), out,
             plan->results().string());
  return kDone;
}

int do_one(const FleetPlan& plan, const std::string& number, int threads) {
  StopSignals signals;
  const std::size_t place = parse_number<std::size_t>(number).value_or(0);
  if (place < 1 || place > plan.tasks.size()) {
    log_error("task '{}': the tasks of {} have the numbers 1 to {}", number, plan.file.string(), plan.tasks.size());
    return kWrongUse;
  }
  const FleetTask& task = plan.tasks[place - 1];
  bool is_new = false;
  const auto result = do_task(plan, task, hueline_replayer(threads), signals.asked(), &is_new);
  tell_end(plan, place, result, is_new);
  return result.ok() ? exit_status(result->end) : kOutputRefused;
}

void add_fleet_plan(Command& fleet) {
  struct Options {
    FleetWish wish;
    std::string out;
  };
  auto options = std::make_shared<Options>();
  options->wish.trajectory_time = "gps";
  FleetWish& wish = options->wish;
  Command command =
      fleet.command("plan", "write which drives are fused again and with what, with the SHA-256 of every input");
  command.required("DRIVES", wish.drives, "recordings, or folders of drives");
  command.required("--out", options->out,
                   "file of the plan, which ends with .json; the results come into the folder of that name without it");
  command.option("--rig", wish.rig,
                 "rig file to use instead of the recorded ones; {drive} stands for the drive's name");
  command.option("--trajectory", wish.trajectory,
                 "trajectory that was calculated after the drive (SBET); {drive} stands for the drive's name");
  command.option("--trajectory-sigma", wish.trajectory_sigma, "its accuracies (SMRMSG); with {drive} too");
  command.setting("--trajectory-time", wish.trajectory_time,
                  "what its times are: seconds of the GPS week, or of the same week in UTC", {"gps", "utc"});
  command.option(
      "--trajectory-point", wish.trajectory_point,
      "the point of the vehicle whose places it has, if it is not the POS's: right,forward,up of that, in m");
  command.reads(wish.drives).writes(options->out);
  command.footer(
      "Example: hueline fleet plan drives/monday drives/tuesday --rig better.yaml --out november.json\n"
      "Exit status: 0; 2 if two drives have one name; 3 if a recording or another input cannot be read.\n"
      "More: docs/fleet.md");
  command.runs([options] { return plan_fleet(options->wish, options->out); });
}

void add_fleet_run(Command& fleet) {
  struct Options {
    std::string plan;
    int jobs = 1, threads = 2;
  };
  auto options = std::make_shared<Options>();
  Command command =
      fleet.command("run", "do the tasks of a plan on this computer; what is done already is not done again");
  command.required("PLAN", options->plan, "file that `hueline fleet plan` has written");
  command.setting("--jobs", options->jobs, "number of drives at a time", {1, 256});
  command.footer(
      "Example: hueline fleet run november.json --jobs 4\n"
      "Exit status: 0 if all drives are done; 7 if some are open; otherwise that of the drives that failed, and 1 if "
      "they failed in different ways.\n"
      "More: docs/fleet.md");
  command.setting("--threads", options->threads, kThreadsHelp, {1, 64});
  command.reads(options->plan);
  command.runs([options] {
    return with_plan(options->plan, [&](const FleetPlan& plan) {
      StopSignals signals;
      return run_fleet(plan, options->jobs, hueline_replayer(options->threads), signals.asked());
    });
  });
}

void add_fleet_task(Command& fleet) {
  struct Options {
    std::string plan, number;
    int threads = 2;
  };
  auto options = std::make_shared<Options>();
  Command command = fleet.command("task", "do one task of a plan; this is what a cluster's scheduler calls");
  command.required("PLAN", options->plan, "file that `hueline fleet plan` has written");
  command.required("NUMBER", options->number, "number of the task, from 1 on");
  command.footer(
      "Example: hueline fleet task november.json 1\n"
      "Exit status: 0; 2 if the plan has no such task; otherwise that of the replay.\n"
      "More: docs/fleet.md");
  command.setting("--threads", options->threads, kThreadsHelp, {1, 64});
  command.reads(options->plan);
  command.runs([options] {
    return with_plan(options->plan,
                     [&](const FleetPlan& plan) { return do_one(plan, options->number, options->threads); });
  });
}

void add_fleet_status(Command& fleet) {
  auto file = std::make_shared<std::string>();
  Command command = fleet.command(
      "status", "say how many drives are done, which have failed and why, and which are open; status 0: all are done");
  command.required("PLAN", *file, "file that `hueline fleet plan` has written");
  command.footer(
      "Example: hueline fleet status november.json\n"
      "Exit status: 0 if all drives are done; 3 if the file is no plan; 7 if some are open; otherwise that of the "
      "drives that failed, and 1 if they failed in different ways.\n"
      "More: docs/fleet.md");
  command.reads(*file);
  command.runs([file] {
    return with_plan(*file, [](const FleetPlan& plan) {
      const FleetState state = FleetState::read(plan);
      std::fputs(state.text(plan).c_str(), stdout);
      return state.exit_status();
    });
  });
}

void add_fleet_submit(Command& fleet) {
  struct Options {
    std::string plan, engine = "slurm";
    SubmitWish wish;
    bool only_write = false;
  };
  auto options = std::make_shared<Options>();
  SubmitWish& wish = options->wish;
  Command command = fleet.command("submit", "give the tasks that are not done to the scheduler of a cluster");
  command.required("PLAN", options->plan,
                   "file that `hueline fleet plan` has written; it, the drives and the results must be on a disk that "
                   "all computers of the cluster share");
  command.setting("--engine", options->engine,
                  "slurm: a job array, by sbatch; snakemake: a Snakefile, and the command that runs it",
                  {"slurm", "snakemake"});
  command.option("--partition", wish.partition, "Slurm: the partition");
  command.option("--time", wish.time, "Slurm: the longest time of a task, such as 2:00:00");
  command.option("--memory", wish.memory, "Slurm: the memory of a task, such as 8G");
  command.setting("--threads", wish.threads, "processors of a task, and colouring threads of its replay", {1, 64});
  command.setting("--at-once", wish.at_once, "Slurm: most tasks that run at the same time; 0: any number", {0, 1e6});
  command.option("--sbatch", wish.further, "a further option for sbatch, such as --sbatch=--account=survey");
  command.flag("--only-write", options->only_write, "write the scripts, and leave it to you to submit them");
  command.footer(
      "Example: hueline fleet submit november.json --partition day --memory 8G\n"
      "Exit status: 0; 1 if the scheduler refuses; 3 if the file is no plan; 4 if the scripts cannot be written.\n"
      "More: docs/fleet.md");
  command.reads(options->plan);
  command.runs([options] {
    return with_plan(options->plan, [&](const FleetPlan& plan) {
      const auto tasks = FleetState::read(plan).to_do();
      if (tasks.empty()) {
        fmt::print("all {} drives are done, nothing is submitted\n", plan.tasks.size());
        return static_cast<int>(kDone);
      }
      return options->engine == "slurm" ? submit_to_slurm(plan, tasks, options->wish, options->only_write)
                                        : write_snakefile(plan, tasks, options->wish);
    });
  });
}

void add_fleet_upload(Command& fleet) {
  struct Options {
    std::string plan, address;
  };
  auto options = std::make_shared<Options>();
  Command command = fleet.command("upload", "put the results of a plan into object storage, as far as they are there");
  command.required("PLAN", options->plan, "file that `hueline fleet plan` has written");
  command.required("ADDRESS", options->address, "s3://BUCKET/KEY, which gets a folder for each drive");
  command.footer(
      "Example: hueline fleet upload november.json s3://survey/november\n"
      "Exit status: 0; 3 if the file is no plan; 4 if the storage refuses; 7 if drives are still open.\n"
      "More: docs/fleet.md");
  command.reads(options->plan);
  command.runs([options] {
    return with_plan(options->plan, [&](const FleetPlan& plan) { return upload_results(plan, options->address); });
  });
}

int catalogue(const std::vector<std::string>& named, const std::string& out) {
  if (std::ranges::any_of(named, PostgresAddress::is_meant)) {
    log_error("the address of a database is given with --out");
    return kWrongUse;
  }
  const auto output = CatalogueOutput::of(out);
  if (!output.ok()) {
    log_error("--out: {}", output.error().message);
    return kWrongUse;
  }
  if (const Status ready = (*output)->check(); !ready.ok()) {
    log_error("{}", ready.error().message);
    return kOutputRefused;
  }
  std::vector<CatalogueEntry> entries;
  int status = kDone;
  for (const std::string& one : named) {
    if (!one.ends_with(".json")) {
      if (const Status there = check_is_there(one); there.ok()) {
        entries.push_back(entry_of(one));
      } else {
        log_error("not in the catalogue: {}", there.error().message);
        status = kInputUnreadable;
      }
      continue;
    }
    const int read = with_plan(one, [&](const FleetPlan& plan) {
      for (const FleetTask& task : plan.tasks) entries.push_back(entry_of(plan, task));
      return static_cast<int>(kDone);
    });
    if (read != kDone) return read;
  }
  if (entries.empty()) return status;
  for (const CatalogueEntry& entry : entries) {
    if (!entry.rig.empty()) continue;
    log_error("{}: {}", entry.name, entry.text);
    status = kInputUnreadable;
  }
  const auto written = (*output)->write(entries);
  if (!written.ok()) {
    log_error("{}", written.error().message);
    return kOutputRefused;
  }
  fmt::print("{} {}\n", number_of(entries.size()), *written);
  return status;
}

void add_fleet_catalogue(Command& fleet) {
  struct Options {
    std::vector<std::string> named;
    std::string out;
  };
  auto options = std::make_shared<Options>();
  Command command =
      fleet.command("catalogue",
                    "write many drives into a GeoPackage, a database or a page: when, where, rig, verdict, figures, "
                    "costs, and the SHA-256 of the products");
  command.required("DRIVES", options->named,
                   "folders of drives, recordings, or plans (.json), of which all drives are taken");
  command.required("--out", options->out,
                   "the GeoPackage, such as fleet.gpkg; the page for people, such as fleet.html; or the database, "
                   "postgresql://USER@HOST/DATABASE, in which the "
                   "rows of these drives are replaced and those of others stay; its password belongs in ~/.pgpass");
  command.reads(options->named);
  command.footer(
      "Example: hueline fleet catalogue november.json --out november.gpkg\n"
      "Exit status: 0; 3 if a drive could not be read; 4 if the catalogue cannot be written.\n"
      "More: docs/fleet.md");
  command.runs([options] { return catalogue(options->named, options->out); });
}

}  // namespace

void add_fleet(Command& all) {
  Command fleet = all.command(kFleet.word, kFleet.help);
  fleet.needs_command();
  add_fleet_plan(fleet);
  add_fleet_run(fleet);
  add_fleet_task(fleet);
  add_fleet_status(fleet);
  add_fleet_submit(fleet);
  add_fleet_upload(fleet);
  add_fleet_catalogue(fleet);
}

}  // namespace hueline::apps
