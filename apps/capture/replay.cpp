#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "apps/capture/expectation.hpp"
#include "apps/capture/trajectory_options.hpp"
#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/signals.hpp"
#include "core/feed_protocol.hpp"
#include "core/output_file.hpp"
#include "runtime/feed.hpp"
#include "runtime/outputs.hpp"
#include "runtime/pacer.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/readiness.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_part.hpp"

namespace hueline::apps {
namespace {

struct ReplayOptions {
  std::string recording, out, rig, expect, write_expect, junit;
  TrajectoryOptions trajectory;
  double speed = 0;
  double from_s = 0;
  int threads = 2;
  bool has_no_feed = false;
};

int status_of_verdict(const runtime::Summary& summary) {
  return summary.verdict() && summary.verdict()->grade == runtime::Grade::Again ? kDriveAgain : kDone;
}

/// Compares the products with what is expected of them. Returns the exit status of the replay, whose own is `status`.
int judge(const ReplayOptions& options, int status) {
  if (!options.write_expect.empty()) {
    const Status written = write_expectation(options.write_expect, options.out);
    if (written.ok()) return status;
    log_error(written.error().message);
    return kOutputRefused;
  }
  if (options.expect.empty()) return status;
  const auto results = compare_with_expectation(options.expect, options.out);
  if (!results.ok()) {
    log_error(results.error().message);
    return opening_status(results.error());
  }
  bool is_as_expected = true;
  for (const Expected& one : *results) {
    if (one.problem.empty()) continue;
    log_error("{}: {}", one.name, one.problem);
    is_as_expected = false;
  }
  if (!options.junit.empty())
    if (const Status written = write_output(options.junit, junit_of(*results, options.recording)); !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
  if (!is_as_expected) return kNotAsExpected;
  log_info("all {} figures are as expected", results->size());
  return kDone;
}

/// The part of the recording that is replayed, and how it is shown. The clocks of a part know nothing at its beginning,
/// so it begins some time before the second that is wanted, and what lies between is done without waiting.
/// Thread safety: state() and pacer().set() on any thread, the others on the replay's.
class Part {
 public:
  static constexpr double kRunUp_s = 20;

  Part(const ReplayOptions& options, storage::JournalReader& journal)
      : journal_(journal),
        from_s_(options.from_s),
        begin_s_(std::max(0.0, from_s_ - kRunUp_s)),
        choice_(storage::JournalPart{begin_s_, {}, {}}),
        pacer_(options.speed, from_seconds(from_s_ - begin_s_)) {}

  /// Returns whether the packet belongs to the part.
  bool take(const Packet& packet) {
    // The whole recording is replayed as it is, ledgers of an older order of packets too.
    const bool is_kept = choice_.judge(packet) == storage::PartChoice::Fate::Keep || begin_s_ <= 0;
    if (!std::exchange(has_begun_, true)) {
      if (const auto newest = journal_.newest())
        duration_s_ = to_seconds(std::max(*newest - choice_.begin(), nanoseconds(0)));
      if (begin_s_ > 0) journal_.skip_before(choice_.begin() + from_seconds(begin_s_));
    }
    position_s_ = to_seconds(choice_.newest());
    return is_kept;
  }
  Packet of_part(Packet packet) const {
    if (begin_s_ > 0) packet.sequence = choice_.sequence_of(packet);
    return packet;
  }
  double begin_s() const { return begin_s_; }
  runtime::Pacer& pacer() { return pacer_; }
  runtime::ReplayState state() const {
    const double duration_s = duration_s_;
    return {pacer_.pace(), from_s_, position_s_,
            duration_s > 0 ? std::optional<double>(duration_s) : std::optional<double>()};
  }

 private:
  storage::JournalReader& journal_;
  const double from_s_, begin_s_;
  storage::PartChoice choice_;
  runtime::Pacer pacer_;
  bool has_begun_ = false;
  std::atomic<double> position_s_{0}, duration_s_{0};
};

int replay(const ReplayOptions& options) {
  StopSignals signals;
  if (!options.expect.empty())
    if (const Status known = check_expectation(options.expect); !known.ok()) {
      log_error(known.error().message);
      return opening_status(known.error());
    }
  auto recording = runtime::Recording::open(options.recording, options.rig);
  if (!recording.ok()) {
    log_error(recording.error().message);
    return opening_status(recording.error());
  }
  if (const Status within = storage::check_begin(*recording->journal, options.from_s); !within.ok()) {
    log_error("--from {}: {}; give a smaller one", options.from_s, within.error().message);
    return kWrongUse;
  }
  auto opened = options.trajectory.open(options.recording, options.rig);
  if (!opened.ok()) {
    log_error(opened.error().message);
    return opening_status(opened.error());
  }
  runtime::PostTrajectory* const trajectory = opened->get();
  if (const Status map = runtime::check_map(recording->rig); !map.ok()) {
    log_error("{}; --rig names a corrected one", map.error().message);
    return kWrongUse;
  }
  auto outputs = runtime::Outputs::create(recording->rig, options.out,
                                          [](const std::string& trouble) { log_error("{}", trouble); });
  if (!outputs.ok()) {
    log_error(outputs.error().message);
    return outputs.error().code == ErrorCode::Invalid ? kWrongUse : kOutputRefused;
  }
  runtime::Outputs& sink = **outputs;
  Part part(options, *recording->journal);
  std::unique_ptr<runtime::Feed> live;
  if (!options.has_no_feed) {
    const std::filesystem::path folder = options.out;
    auto made = runtime::Feed::create(
        folder / feed::kSocketName, recording->rig, sink,
        {.mode = "replay",
         .drive = std::filesystem::absolute(folder).lexically_normal().filename().string(),
         .live = {},
         .on_command = [](const DriveCommand& command) -> Status {
           if (command.kind == DriveCommand::Kind::Stop) return ::kill(::getpid(), SIGTERM), Status();
           return Error{ErrorCode::Unsupported, "a replay takes no marks: they belong to the drive's own recording"};
         },
         .replay = [&part] { return part.state(); },
         .on_pace = [&part](const runtime::Pace& pace) { part.pacer().set(pace); },
         .begin_s = part.begin_s()});
    if (made.ok())
      live = std::move(*made);
    else
      log_warning("no live feed: {}; the replay goes on without it", made.error().message);
  }
  runtime::Pipeline pipeline(recording->rig, options.threads, live ? static_cast<runtime::ProductSink&>(*live) : sink,
                             trajectory);
  bool stopped = false;
  const Status read = recording->for_each([&](const Packet& recorded) {
    if (!part.take(recorded)) return !(stopped = signals.asked().stop_requested());
    runtime::Pacer& pacer = part.pacer();
    pacer.take(recorded);
    while (!stopped && !pacer.is_due()) stopped = signals.wait_for(pacer.wait());
    stopped = stopped || signals.asked().stop_requested();
    if (stopped) return false;
    const Packet packet = part.of_part(recorded);
    sink.summary().on_packet(packet);
    pipeline.process(packet);
    if (live) live->note(packet, pipeline);
    return true;
  });
  pipeline.flush();
  if (live) live->finish(pipeline);
  pipeline.report(sink.summary());
  sink.summary().on_removed(recording->journal->removed());
  if (stopped) sink.summary().on_early_end("stopped before the recording's end");
  // The recording may be whole: its disk or the network did not give it.
  if (!read.ok() && read.error().code == ErrorCode::Io) sink.summary().on_early_end(read.error().message);
  const Status finished = sink.finish(&pipeline.health());
  std::fputs(sink.summary().text().c_str(), stdout);
  if (!finished.ok()) {
    log_error(finished.error().message);
    return kOutputRefused;
  }
  if (trajectory != nullptr && !trajectory->status().ok()) {
    log_error("{}: the cloud ends with it", trajectory->status().error().message);
    return kInputUnreadable;
  }
  if (!read.ok()) {
    log_error("{}: everything that is whole was used", read.error().message);
    return kInputUnreadable;
  }
  if (stopped) {
    log_warning("stopped before the recording's end: cloud, view and summary end early");
    return kStopped;
  }
  return judge(options, sink.summary().points() ? status_of_verdict(sink.summary()) : kNothingCame);
}

}  // namespace

void add_replay(Command& all) {
  auto options = std::make_shared<ReplayOptions>();
  Command command = all.command(
      "replay", "process a recording again with the same decoders, clocks and colouring; gives the same bytes");
  command.required("RECORDING", options->recording,
                   "drive.mcap or a drive's folder; a recording that was cut by a crash is read as far as it is whole");
  command.required("--out", options->out, "folder for cloud.las, view.mcap, summary.json, report.html and report.pdf");
  command.setting("--speed", options->speed,
                  "1: as fast as it was driven; 0.5: half as fast; 0: as fast as this computer can", {0.0, 1000.0});
  command.setting("--from", options->from_s,
                  "s after the recording's first packet, as in the verdict and for `cut`: for looking at a drive from "
                  "there. The products are those of the part, not those of the drive: of what `cut` copies from 20 s "
                  "before, in which the clocks lock; these 20 s are not paced",
                  {0, 1e9});
  command.setting("--threads", options->threads, "number of colouring threads; it does not change the result", {1, 64});
  command.flag("--no-feed", options->has_no_feed, "make no live feed (the socket `feed` in the folder of --out)");
  command.option("--rig", options->rig,
                 "rig file to use instead of the recorded one, for a better calibration or another method; its sensors "
                 "must have the same names in the same order");
  options->trajectory.declare(command);
  command.option("--expect", options->expect,
                 "file of what the products must be (docs/formats.md); the exit status is 0 if they are, and 6 if not");
  command.option("--junit", options->junit, "with --expect: also write the results as a test report (JUnit's XML)");
  command.option("--write-expect", options->write_expect, "write such a file of what the products are");
  command.needs("--junit", "--expect").excludes("--write-expect", "--expect");
  command.reads(options->recording).reads(options->rig).reads(options->expect).writes_into(options->out);
  command.writes(options->junit).writes(options->write_expect);
  command.footer(
      "Example: hueline replay drives/today --rig better.yaml --out again\n"
      "Exit status: 0; 3 if the recording could be read only in part; 6 if --expect is not met; 8 if the verdict is to "
      "drive again.\n"
      "More: docs/operating.md");
  command.runs([options] { return replay(*options); });
}

}  // namespace hueline::apps
