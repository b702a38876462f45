#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/capture/capture_ending.hpp"
#include "apps/capture/followers.hpp"
#include "apps/capture/rig_sources.hpp"
#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/service_manager.hpp"
#include "apps/signals.hpp"
#include "core/feed_protocol.hpp"
#include "core/mutex.hpp"
#include "core/output_file.hpp"
#include "core/standard_streams.hpp"
#include "drivers/transport/host_clock.hpp"
#include "runtime/feed.hpp"
#include "runtime/live_run.hpp"
#include "runtime/outputs.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/readiness.hpp"
#include "runtime/recording.hpp"
#include "storage/recording_config.hpp"

namespace hueline::apps {
namespace {

struct CaptureOptions {
  std::string rig;
  std::string out, drives;
  int threads = 2;
  double seconds = 0;  // 0: until stopped
  double buffer_megabytes = 2048;
  bool ends_when_silent = false;
  bool quiet = false;
  bool has_no_feed = false;
};

const char* word(runtime::Reader::State state) {
  switch (state) {
    case runtime::Reader::State::Connecting:
      return "connecting";
    case runtime::Reader::State::Running:
      return "running";
    case runtime::Reader::State::Silent:
      return "SILENT";
    case runtime::Reader::State::Ended:
      return "ended";
  }
  return "?";
}

/// The changes of the health that wait to be shown. Thread-safe.
class HealthLines {
 public:
  explicit HealthLines(const config::Rig& rig) : names_(rig.sensor_names()) { names_[kSystemSensor] = "drive"; }
  void add(const runtime::HealthChange& change) {
    Lock lock(mutex_);
    changes_.push_back(change);
  }
  /// Logs them. `before` is called before the first one.
  template <class Before>
  void show(const Before& before) {
    std::vector<runtime::HealthChange> changes;
    {
      Lock lock(mutex_);
      changes.swap(changes_);
    }
    if (!changes.empty()) before();
    for (const auto& change : changes) {
      const std::string line = fmt::format("{}: {}", names_.at(change.sensor), text(change));
      if (change.level == runtime::HealthLevel::Alarm)
        log_error(line);
      else if (change.level == runtime::HealthLevel::Warning)
        log_warning("{}", line);
      else
        log_info("{}", line);
    }
  }

 private:
  std::vector<std::string> names_;
  Mutex mutex_;
  std::vector<runtime::HealthChange> changes_ HUELINE_GUARDED_BY(mutex_);
};

/// Shows the progress of the capture in one line. On a terminal the line is rewritten each second. Elsewhere, where
/// every line stays, it is written each minute, and whenever a device's state changes or something is lost for the
/// first time.
class Progress {
 public:
  explicit Progress(bool quiet) : quiet_(quiet), is_terminal_(isatty(STDERR_FILENO) != 0) {}
  void show(double seconds, const runtime::LiveRun& run, std::uint64_t points) {
    if (quiet_) return;
    std::string line = fmt::format("{:5.0f} s  {:8.1f} MB recorded  {:9} points", seconds,
                                   static_cast<double>(run.recorded_bytes()) / 1e6, points);
    std::string states;
    if (run.waiting_to_be_processed() > 1000)
      line += fmt::format("  {} packets waiting", run.waiting_to_be_processed());
    for (const auto& reader : run.readers()) {
      const auto counts = run.ingest().counts(reader->sensor());
      const auto state = reader->state();
      line += fmt::format("  {}: {}", reader->sensor_name(), counts.packets);
      if (state != runtime::Reader::State::Running) line += fmt::format(" ({})", word(state));
      if (counts.shed) line += fmt::format(" [{} shed]", counts.shed);
      if (counts.refused) line += fmt::format(" [{} LOST]", counts.refused);
      states += fmt::format("{}{}{} ", word(state), counts.shed > 0, counts.refused > 0);
    }
    constexpr double kEvery_s = 60;
    if (!is_terminal_ && states == states_ && seconds - shown_s_ < kEvery_s) return;
    states_ = states;
    shown_s_ = seconds;
    std::fprintf(stderr, is_terminal_ ? "\r\033[K%s" : "%s\n", line.c_str());
    shown_ = true;
  }
  void end() const {
    if (shown_ && is_terminal_) std::fputc('\n', stderr);
  }

 private:
  const bool quiet_, is_terminal_;
  bool shown_ = false;
  std::string states_;
  double shown_s_ = 0;
};

/// Finds out when all devices have gone, which is the end of an emulated drive.
class Silence {
 public:
  bool lasts(const runtime::LiveRun& run) {
    std::uint64_t packets = 0;
    bool anybody = false;
    for (const auto& reader : run.readers()) {
      packets += run.ingest().counts(reader->sensor()).wire;  // that a device is not there yet is no word of it
      anybody |= reader->state() == runtime::Reader::State::Running;
    }
    quiet_s_ = packets == packets_ || !anybody ? quiet_s_ + 1 : 0;
    const bool heard = packets > 0;
    packets_ = packets;
    return heard && quiet_s_ >= 3;
  }

 private:
  std::uint64_t packets_ = 0;
  int quiet_s_ = 0;
};

/// Returns the limits of the queues: half of the memory may wait for the recorder, and a quarter for the pipeline.
runtime::LiveRun::Config queue_limits(double buffer_megabytes) {
  runtime::LiveRun::Config config;
  config.record_queue.weight = static_cast<std::size_t>(buffer_megabytes * 0.5e6);
  config.pipeline_queue.weight = static_cast<std::size_t>(buffer_megabytes * 0.25e6);
  return config;
}

/// Returns what the program says if it is ended before it could finish: what is whole and what is not.
std::string last_words(const runtime::LiveRun& run, const std::string& recording) {
  return run.is_recording_closed() && run.recording().ok()
             ? fmt::format("ended at once: {} is whole; cloud.las, view.mcap and summary.json are not: {}", recording,
                           replay_of(recording))
             : fmt::format(
                   "ended at once: the disk did not take the end of {0}; hueline inspect {0} says how far it is whole",
                   recording);
}

/// Logs what happened to the files of the recording. `before` makes room for the first line.
void log_news(runtime::LiveRun& run, const std::function<void()>& before) {
  const auto news = run.take_news();
  if (!news.empty()) before();
  for (const auto& one : news) {
    if (one.is_trouble)
      log_warning("{}", one.text);
    else
      log_info("{}", one.text);
  }
}

/// Logs how many files the recording has.
void log_segments(const storage::SegmentedJournal& journal) {
  if (journal.segment() > 1)
    log_info("the recording is in {} segments", journal.segment() - journal.removed().segments);
  if (journal.failed_splits() > 0)
    log_warning("{} times the recording could not go on in a new file", journal.failed_splits());
}

/// A run in progress, and what watch_run() reads and updates each second.
struct Watched {
  runtime::LiveRun& run;
  runtime::DiskReserve& reserve;
  const std::atomic<std::uint64_t>& points;
  HealthLines& health;
  Followers& followers;
  bool is_live;  ///< at least one sensor is a device, not a recording
};

/// Of a recording that is cut off, what came behind its last ledger is proved by the sequence alone.
constexpr std::uint64_t kTicksPerLedger = 10;

/// Shows the progress until the sources end, a stop is requested, or the options say that it is time to end. Returns
/// false if it has reported that drive.mcap is no longer in its place.
bool watch_run(const Watched& watched, const CaptureOptions& options, const StopSignals& signals) {
  runtime::LiveRun& run = watched.run;
  Progress progress(options.quiet);
  Silence silence;
  bool is_in_place = true;
  std::uint64_t ticks = 0;
  const HostTime begin = drivers::host_now();
  while (!run.wait_until_over(std::chrono::seconds(1), signals.asked())) {
    if (signals.asked().stop_requested()) {
      progress.end();
      log_info("stop asked for: processing what has come; a second Ctrl-C ends at once");
      break;
    }
    if (is_in_place && !run.place().ok()) {
      progress.end();
      is_in_place = false;
      log_error(run.place().error().message);
    }
    log_news(run, [&] { progress.end(); });
    watched.health.show([&] { progress.end(); });
    watched.followers.look(watched.reserve);
    const double seconds = to_seconds(drivers::host_now() - begin);
    watched.reserve.note(run.recorded_bytes(), seconds);
    service_manager::tell_alive(fmt::format("{:.0f} s, {:.1f} MB recorded, {} points", seconds,
                                            static_cast<double>(run.recorded_bytes()) / 1e6,
                                            watched.points.load(std::memory_order_relaxed)));
    progress.show(seconds, run, watched.points.load(std::memory_order_relaxed));
    // A tick moves stream time on when every device is silent, and says how much room the disk has. Recordings have
    // their own time.
    if (watched.is_live) {
      run.ingest().submit(Packet{kSystemSensor, PacketKind::Tick, false, 0, drivers::host_now(),
                                 Buffer::copy_of(encode_tick(watched.reserve.free_bytes()))});
      if (++ticks % kTicksPerLedger == 0) run.ingest().submit_ledger();
    }
    if (options.seconds > 0 && seconds >= options.seconds) break;
    if (options.ends_when_silent && silence.lasts(run)) break;
  }
  progress.end();
  return is_in_place;
}

/// Returns what the live feed shows of a running capture. Called on the feed's thread.
runtime::LiveState live_state(const runtime::LiveRun& run, const runtime::DiskReserve& reserve,
                              const runtime::LiveRun::Config& limits) {
  runtime::LiveState live;
  for (const auto& reader : run.readers()) {
    const auto counts = run.ingest().counts(reader->sensor());
    const char* state = reader->state() == runtime::Reader::State::Silent ? "silent" : word(reader->state());
    live.sensors.push_back({state, counts.shed, counts.refused});
  }
  const auto queue = [](const char* name, std::pair<std::size_t, std::size_t> filled,
                        const runtime::PacketQueue::Limits& most) {
    const auto share = [](std::size_t part, std::size_t whole) {
      return static_cast<double>(part) / static_cast<double>(whole);
    };
    return runtime::LiveState::Queue{name, filled.first,
                                     std::max(share(filled.first, most.items), share(filled.second, most.weight))};
  };
  live.queues.push_back(queue("record", run.waiting_to_be_recorded(), limits.record_queue));
  live.queues.push_back(queue("pipeline", run.waiting_in_pipeline(), limits.pipeline_queue));
  live.recorded_bytes = run.recorded_bytes();
  live.free_bytes = reserve.free_bytes();
  return live;
}

/// The running capture as the feed's thread may reach it: not after its end. Commands that come before it runs are
/// kept, for the feed is there a moment earlier. Thread-safe.
class Reachable {
 public:
  void begin(runtime::LiveRun& run) {
    const Lock lock(mutex_);
    run_ = &run;
    for (const DriveCommand& command : std::exchange(early_, {}))
      if (const Status taken = submit(command); !taken)
        log_warning("{} of the operator ('{}'): {}", name(command.kind), command.note, taken.error().message);
  }
  void end() {
    const Lock lock(mutex_);
    run_ = nullptr;
    has_ended_ = true;
  }
  runtime::LiveState state(const runtime::DiskReserve& reserve, const runtime::LiveRun::Config& limits) {
    const Lock lock(mutex_);
    return run_ ? live_state(*run_, reserve, limits) : runtime::LiveState{};
  }
  /// Lets a command of the operator enter the journal.
  Status take(const DriveCommand& command) {
    constexpr std::size_t kMostEarly = 100;
    const Lock lock(mutex_);
    if (run_) return submit(command);
    if (has_ended_ || early_.size() >= kMostEarly)
      return Error{ErrorCode::Unavailable, "the drive is not recorded at this moment"};
    early_.push_back(command);
    return {};
  }

 private:
  Status submit(const DriveCommand& command) HUELINE_REQUIRES(mutex_) {
    const bool is_stop = command.kind == DriveCommand::Kind::Stop;
    if (is_stop && stops_) return {};  // a second signal would end at once
    if (!run_->ingest().submit(Packet{kSystemSensor, PacketKind::Command, false, 0, drivers::host_now(),
                                      Buffer::copy_of(encode_command(command))}))
      return Error{ErrorCode::Exhausted, "not recorded: the drive is ending, or its disk is too slow at this moment"};
    if (is_stop) ::kill(::getpid(), SIGTERM);  // as Ctrl-C does
    stops_ = stops_ || is_stop;
    return {};
  }

  Mutex mutex_;
  runtime::LiveRun* run_ HUELINE_GUARDED_BY(mutex_) = nullptr;
  bool has_ended_ HUELINE_GUARDED_BY(mutex_) = false;
  std::vector<DriveCommand> early_ HUELINE_GUARDED_BY(mutex_);
  bool stops_ HUELINE_GUARDED_BY(mutex_) = false;
};

/// Makes a folder for a new drive in `drives`, which is made too, named by the time in UTC.
Result<std::filesystem::path> make_drive_folder(const std::filesystem::path& drives) {
  std::error_code refused;
  std::filesystem::create_directories(drives, refused);
  if (refused) return output_error("make folder " + drives.string(), refused.value());
  const std::string time = fmt::format("{:%Y-%m-%d_%H%M%S}", fmt::gmtime(std::time(nullptr)));
  // A drive that begins again within a second, or a clock that was set back, finds its name taken.
  constexpr int kMostOfOneName = 1000;
  for (int i = 1; i <= kMostOfOneName; ++i) {
    const auto folder = drives / (i == 1 ? time : fmt::format("{}_{}", time, i));
    std::error_code failed;
    if (std::filesystem::create_directory(folder, failed)) return folder;
    if (failed) return Error{ErrorCode::Io, fmt::format("{}: {}", folder.string(), failed.message())};
  }
  return Error{ErrorCode::Io, fmt::format("{}: {} drives are named {}: is the computer's clock set?", drives.string(),
                                          kMostOfOneName, time)};
}

/// Logs what is wrong with the rig as a whole. The capture goes on: a drive with one sensor less is worth more than
/// none, and more than a cloud, which a replay can make.
void log_findings(const config::Rig& rig) {
  for (const runtime::Finding& one : runtime::check_rig(rig)) {
    if (one.prevents)
      log_error("{}: {}; {}", one.about, one.text, one.action);
    else
      log_warning("{}: {}; {}", one.about, one.text, one.action);
  }
  if (!runtime::check_map(rig).ok())
    log_warning("no cloud can be written; everything is recorded, and a replay with a corrected rig makes the cloud");
}

int capture(const CaptureOptions& options) {
  if (options.out.empty() == options.drives.empty()) {
    log_error("{}give --out FOLDER for this drive, or --drives FOLDER, in which it gets a folder of its own",
              options.out.empty() ? "" : "--out and --drives are both given: ");
    return kWrongUse;
  }
  StopSignals signals;  // before any thread
  const config::Rig rig = config::load_rig(options.rig);
  signals.end_within(std::chrono::milliseconds(static_cast<std::int64_t>(rig.end_within_s * 1000)));
  log_findings(rig);
  std::filesystem::path dir = options.out;
  if (options.out.empty()) {
    auto made = make_drive_folder(options.drives);
    if (!made.ok()) {
      log_error(made.error().message);
      return kOutputRefused;
    }
    dir = std::move(*made);
  }
  auto outputs = runtime::Outputs::create(rig, dir, [](const std::string& trouble) { log_error("{}", trouble); });
  if (!outputs.ok()) {
    log_error(outputs.error().message);
    return outputs.error().code == ErrorCode::Invalid ? kWrongUse : kOutputRefused;
  }
  const std::string recording = (dir / "drive.mcap").string();
  auto journal = storage::SegmentedJournal::create(recording, runtime::journal_header(rig),
                                                   rig.recording.journal(storage::random_recording_name()));
  if (!journal.ok()) {
    log_error(journal.error().message);
    return kOutputRefused;
  }

  for (const std::string& volume : rig.recording.volumes)
    if (const std::string trouble = storage::volume_trouble(volume, dir); !trouble.empty())
      log_warning("recording.volumes: {} {}", volume, trouble);

  runtime::Outputs& sink = **outputs;
  runtime::DiskReserve reserve(recording, storage::Disk::kernel(), rig.recording.volumes);
  sink.keep(reserve);
  HealthLines health(rig);
  sink.tell_health([&](const runtime::HealthChange& change) { health.add(change); });
  Reachable reachable;
  const runtime::LiveRun::Config limits = queue_limits(options.buffer_megabytes);
  std::unique_ptr<runtime::Feed> live;
  if (!options.has_no_feed) {
    auto made =
        runtime::Feed::create(dir / feed::kSocketName, rig, sink,
                              {.mode = "capture",
                               .drive = std::filesystem::absolute(dir).lexically_normal().filename().string(),
                               .live = [&] { return reachable.state(reserve, limits); },
                               .on_command = [&](const DriveCommand& command) { return reachable.take(command); }});
    if (made.ok())
      live = std::move(*made);
    else
      log_warning("no live feed: {}; the capture goes on without it", made.error().message);
  }
  runtime::Pipeline pipeline(rig, options.threads, live ? static_cast<runtime::ProductSink&>(*live) : sink);
  std::atomic<std::uint64_t> points{0};
  const auto process = [&](const Packet& packet) {
    sink.summary().on_packet(packet);
    pipeline.process(packet);
    if (live) live->note(packet, pipeline);
    points.store(sink.summary().points(), std::memory_order_relaxed);
  };
  const BufferPool pool(static_cast<std::size_t>(options.buffer_megabytes * 1e6));
  runtime::LiveRun run(sources_of(rig, pool), std::make_unique<storage::SegmentedJournal>(std::move(*journal)), process,
                       limits);
  const StopSignals::Duty duty(
      signals, [&] { return run.is_recording_closed(); }, [&] { return last_words(run, recording); });
  log_info("capturing {} into {}; Ctrl-C ends with everything written, a second Ctrl-C ends at once", rig.name,
           dir.string());
  const bool is_live = std::any_of(rig.sensors.begin(), rig.sensors.end(), [](const auto& sensor) {
    return sensor.device->arrivals() == drivers::Arrivals::Live;
  });
  run.start();
  reachable.begin(run);
  service_manager::tell_ready();
  Followers followers(rig, dir);
  const bool was_in_place = watch_run({run, reserve, points, health, followers, is_live}, options, signals);
  service_manager::tell_stopping();
  run.stop(signals.at_once());
  reachable.end();
  health.show([] {});

  Ending ending;
  ending.is_cut = run.are_products_cut() || signals.at_once().stop_requested();
  if (!ending.is_cut) pipeline.flush();
  if (live) live->finish(pipeline);
  pipeline.report(sink.summary());
  log_missing_packets(rig, run, ending.is_cut);
  log_news(run, [] {});
  log_segments(run.journal());
  sink.summary().on_removed(run.journal().removed());
  ending.recorded = recorded_part(run);
  ending.place = run.place();
  summarise(ending, was_in_place, rig, run, sink.summary());
  ending.finished = sink.finish(&pipeline.health());
  std::fputs(sink.summary().text().c_str(), stdout);
  const int followed = followers.finish(signals);
  int status = status_of_files(ending, run, recording);
  if (status == kDone) status = followed;
  // A reader that a device's library holds cannot be joined. The process ends without it.
  if (status == kStopped && run.is_a_reader_stuck()) {
    (void)flush_standard_output();
    std::_Exit(kStopped);
  }
  return status != kDone ? status : status_of_sources(run, sink.summary(), recording);
}

}  // namespace

void add_capture(Command& all) {
  auto options = std::make_shared<CaptureOptions>();
  Command command = all.command("capture", "record the sensors of a rig, and colour the points while driving");
  command.required("RIG", options->rig,
                   "rig file (YAML) with sensors, mountings and colouring, or the name of a rig that comes with the "
                   "program (street, ladybug5, ...)");
  command.option("--out", options->out,
                 "folder of the drive; it is created if it does not exist; an existing recording is never overwritten");
  command.option("--drives", options->drives,
                 "in place of --out: folder of drives, in which this one gets a folder named by the time in UTC; it is "
                 "created if it does not exist");
  command.setting("--threads", options->threads, "number of colouring threads; it does not change the result", {1, 64});
  command.setting("--seconds", options->seconds, "end after this many seconds; 0: run until Ctrl-C", {0.0, 1e6});
  command.setting("--buffer", options->buffer_megabytes, "memory for data that waits for the disk and for fusion, MB",
                  {16.0, 1e6});
  command.flag("--until-silent", options->ends_when_silent,
               "end when all devices have been silent or gone for 3 s (for emulated drives)");
  command.flag("--quiet", options->quiet, "print no progress line");
  command.flag("--no-feed", options->has_no_feed, "make no live feed (the socket `feed` in the drive's folder)");
  command.footer(
      "Faults (a pulled cable, a silent device, lost packets) are recorded, and summed up at the end. The other "
      "devices continue.\n"
      "Example: hueline capture rig.yaml --drives drives\n"
      "Exit status: 0, also after Ctrl-C; 3 if a file that the rig reads is damaged; 4 if the recording or a product "
      "could not be written whole; 5 if no device sent anything or no point could be made; 7 if it was ended at "
      "once; 8 if the verdict is to drive again.\n"
      "More: docs/operating.md");
  command.reads(options->rig).writes_into(options->out).writes_into(options->drives);
  command.runs([options] { return capture(*options); });
}

}  // namespace hueline::apps
