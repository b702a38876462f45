#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/merge/merge_plan.hpp"
#include "apps/progress_bar.hpp"
#include "apps/signals.hpp"
#include "core/input_folder.hpp"
#include "core/remote_store.hpp"

namespace hueline::apps {
namespace {

struct MergeOptions {
  MergeWish wish;
  std::string rig, out;
};

int status_of(const Error& error) {
  if (error.code == ErrorCode::Stopped) return kStopped;
  return error.code == ErrorCode::Invalid ? kWrongUse : kInputUnreadable;
}

int refuse(const Error& error, int status) {
  log_error(error.message);
  return status;
}

/// Finds before anything is read, which takes long, that a recording is not there or is named twice.
Status check_names(const std::vector<std::string>& names) {
  if (names.size() < 2) return Error{ErrorCode::Invalid, "one recording is nothing to merge: name two or more"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::error_code failed;
    // Of an address opening it tells.
    if (!is_address(names[i]) && !std::filesystem::exists(names[i], failed))
      return Error{ErrorCode::Io, fmt::format("open {}: {}", names[i],
                                              failed ? failed.message() : "there is no such recording or folder")};
    for (std::size_t k = 0; k < i; ++k)
      if (absolute_name(names[k]) == absolute_name(names[i]) || std::filesystem::equivalent(names[k], names[i], failed))
        return Error{ErrorCode::Invalid,
                     fmt::format("{} and {} are the same: name each recording once", names[k], names[i])};
  }
  return {};
}

/// Returns an error if two of the recordings, or the output, are one file.
Status check_files(const std::vector<SurveyedJournal>& journals, const std::string& out) {
  std::vector<std::pair<std::filesystem::path, std::string>> seen{{out, "--out"}};
  for (const SurveyedJournal& journal : journals) {
    for (const storage::Segment& segment : journal.recording.journal->segments()) {
      for (const auto& [path, what] : seen) {
        std::error_code ignored;
        if (std::filesystem::equivalent(path, segment.path, ignored))
          return Error{ErrorCode::Invalid, fmt::format("{} and {} are the same file", what, segment.path.string())};
      }
      seen.emplace_back(segment.path, segment.path.string());
    }
  }
  return {};
}

/// Says what was written and what was not. Returns whether all recordings were whole.
bool tell(const runtime::MergedJournal& merged, const std::vector<std::string>& names, const std::string& out) {
  fmt::print("{}: {} packets with {:.1f} MB\n", out, merged.packets, static_cast<double>(merged.bytes) / 1e6);
  bool is_whole = true;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const runtime::MergedJournal::Input& one = merged.inputs[i];
    fmt::print("{}: {} packets, {} left out\n", names[i], one.packets, one.left_out);
    if (one.ledgers == 0) log_warning("{}: it has no ledger, so only its sequence tells what is missing", names[i]);
    if (one.missing > 0)
      log_warning("{}: {} packets are missing; `hueline verify {}` says of which sensors", names[i], one.missing, out);
    if (one.unexplained > 0)
      log_warning("{}: {} packets are missing, and of which sensor is not known", names[i], one.unexplained);
    if (one.contradictions > 0)
      log_warning("{}: {} of its ledgers contradict the packets around them", names[i], one.contradictions);
    if (one.damages > 0)
      log_warning("{}: {} parts are damaged or missing; the first: {}", names[i], one.damages, one.first_damage);
    if (!one.end.ok()) log_warning("{}", one.end.error().message);
    is_whole &= one.end.ok() && one.damages + one.missing + one.unexplained + one.contradictions == 0;
  }
  return is_whole;
}

int merge(MergeOptions& options) {
  MergeWish& wish = options.wish;
  if (Status named = check_names(wish.recordings); !named.ok()) return refuse(named.error(), status_of(named.error()));
  StopSignals signals;
  wish.rig = config::load_rig(options.rig);
  wish.rig_name = options.rig;
  ProgressBar bar;
  std::vector<SurveyedJournal> journals;
  std::uint64_t size = 0;
  for (const std::string& name : wish.recordings) {
    auto one = survey_journal(name, signals.asked(), [&](double share) { bar.show("reading " + name, share); });
    bar.end();
    if (!one.ok()) return refuse(one.error(), status_of(one.error()));
    size += one->recording.journal->file_size();
    journals.push_back(std::move(*one));
  }
  if (Status apart = check_files(journals, options.out); !apart.ok()) return refuse(apart.error(), kWrongUse);
  auto plan = plan_merge(wish, std::move(journals));
  if (!plan.ok()) return refuse(plan.error(), status_of(plan.error()));
  for (const std::string& remark : plan->remarks) fmt::print("{}\n", remark);
  for (const std::string& warning : plan->warnings) log_warning("{}", warning);
  const auto merged =
      runtime::merge_journals(plan->inputs, plan->header, options.out, signals.asked(), [&](std::uint64_t read) {
        bar.show("merging", static_cast<double>(read) / static_cast<double>(std::max<std::uint64_t>(1, size)));
      });
  bar.end();
  if (!merged.ok())
    return refuse(merged.error(), merged.error().code == ErrorCode::Stopped ? kStopped : kOutputRefused);
  return tell(*merged, wish.recordings, options.out) ? kDone : kInputUnreadable;
}

}  // namespace

void add_merge(Command& all) {
  auto options = std::make_shared<MergeOptions>();
  MergeWish& wish = options->wish;
  Command command = all.command(
      "merge", "join the recordings that several computers of one vehicle made of one drive into one recording");
  command.required("RECORDINGS", wish.recordings,
                   "two or more, each drive.mcap or a drive's folder; the clock of the first one is kept");
  command.required("--rig", options->rig, "rig file of the whole vehicle, with the sensors of all recordings");
  command.required("--out", options->out, "the new recording, an .mcap file");
  command.option(
      "--take", wish.take,
      "NAME=N: the sensor NAME comes from the N-th recording, counted from 1, if several have packets of it");
  command.option("--without", wish.without, "sensors that are left out, by their names");
  command.flag("--rig-decides", wish.rig_decides,
               "use the rig of --rig where the keys of a sensor differ from those that it was recorded with");
  command.flag("--same-clock", wish.is_same_clock,
               "the recordings have one clock, because one computer made them without a restart between: their times "
               "stay as they are. Computers that PTP holds together have different clocks in their recordings");
  command.reads(wish.recordings).reads(options->rig).writes_recording(options->out, kMergedFrom);
  command.footer(
      "Each computer must record the receiver's pulses and messages: at the seconds that both saw, their clocks are "
      "compared, and the times of the others are restated in the clock of the first. Their pulses and messages are not "
      "needed any more then, so of a PPS and a POS that several have, the first one's is kept. If the relation of the "
      "clocks cannot be determined, nothing is written. With --same-clock, recordings that follow each other in time, "
      "such as the parts of one that was cut, are joined with all their packets.\n"
      "Example: hueline merge front/drive.mcap rear/drive.mcap --rig vehicle.yaml --out whole.mcap\n"
      "Exit status: 0; 2 if the recordings do not fit together; 3 if one could be read only in part; 7 if it was "
      "stopped.\n"
      "More: docs/operating.md");
  command.runs([options] { return merge(*options); });
}

}  // namespace hueline::apps
