#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/signals.hpp"
#include "core/json_text.hpp"
#include "drivers/transport/host_clock.hpp"
#include "runtime/disk_reserve.hpp"
#include "runtime/live_run.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/readiness.hpp"
#include "runtime/recording.hpp"
#include "runtime/test_exposure.hpp"
#include "storage/recording_config.hpp"

namespace hueline::apps {
namespace {

struct CheckOptions {
  std::string rig, disk = ".";
  double seconds = 6, hours = 4;
  int threads = 2;
  bool is_json = false;
};

/// A file that is removed with this object.
class PassingFile {
 public:
  explicit PassingFile(std::filesystem::path path) : path_(std::move(path)) {}
  PassingFile(const PassingFile&) = delete;
  PassingFile& operator=(const PassingFile&) = delete;
  ~PassingFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
};

/// Returns the folder, or the nearest one above it that is there: a capture makes the others.
std::filesystem::path nearest_folder(const std::filesystem::path& wanted) {
  std::error_code unknown;
  std::filesystem::path folder = std::filesystem::absolute(wanted, unknown);
  while (folder.has_relative_path() && !std::filesystem::exists(folder, unknown)) folder = folder.parent_path();
  return folder;
}

/// Returns how fast the disk takes data, bytes/s, by writing 64 MB to it. Error: Io.
Result<double> disk_speed(const std::filesystem::path& path) {
  const PassingFile file(path);
  const auto refused = [&] { return io_error("64 MB cannot be written to " + path.parent_path().string(), errno); };
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) return refused();
  constexpr std::size_t kPiece = 4 << 20;
  constexpr int kPieces = 16;
  const std::vector<char> piece(kPiece, 'h');
  const auto begin = std::chrono::steady_clock::now();
  bool done = true;
  for (int i = 0; i < kPieces && done; ++i)
    for (std::size_t at = 0; at < kPiece && done;) {
      const ssize_t wrote = ::write(fd, piece.data() + at, kPiece - at);
      done = wrote > 0;
      at += static_cast<std::size_t>(std::max<ssize_t>(wrote, 0));
    }
  done = done && ::fdatasync(fd) == 0;
  const auto wrong = done ? std::optional<Error>() : refused();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ::close(fd);
  if (wrong) return *wrong;
  return static_cast<double>(kPiece) * kPieces / std::max(seconds, 1e-6);
}

/// Counts the points of the short run, looks at its images, and keeps why sensors are not there.
class Heard : public runtime::ProductSink {
 public:
  explicit Heard(const config::Rig& rig) : exposure_(rig) {}
  void on_fault(const Fault& fault) override {
    if (fault.kind == FaultKind::Disconnected || fault.kind == FaultKind::WrongDevice)
      why_[fault.sensor] = fault.detail;
  }
  std::string why_not(SensorId sensor) const {
    const auto found = why_.find(sensor);
    return found == why_.end() ? "it has sent nothing" : "it is not there: " + found->second;
  }
  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override { points_ += block.points.size(); }
  void on_laser(const StampedLaserBatch& batch) override { returns_ += batch.returns.size(); }
  void on_image(const Image& image) override { exposure_.take(image); }
  std::vector<runtime::LensLight> lenses() const { return exposure_.lenses(); }
  double points() const { return static_cast<double>(std::max(points_, returns_)); }

 private:
  runtime::TestExposure exposure_;
  std::map<SensorId, std::string> why_;
  std::uint64_t points_ = 0, returns_ = 0;
};

int check(const CheckOptions& options) {
  StopSignals signals;  // before any thread
  const config::Rig rig = config::load_rig(options.rig);
  std::vector<runtime::Finding> findings = runtime::check_rig(rig);
  std::vector<nlohmann::ordered_json> present;  // for --json: the sensors that are there
  std::vector<runtime::LensLight> lenses;
  const bool is_live = std::any_of(rig.sensors.begin(), rig.sensors.end(), [](const config::Sensor& sensor) {
    return sensor.device->arrivals() == drivers::Arrivals::Live;
  });
  runtime::HostFacts facts = runtime::read_host_facts();
  const std::filesystem::path folder = nearest_folder(options.disk);
  const auto speed = disk_speed(folder / fmt::format(".hueline-check-{}", getpid()));
  facts.disk_bytes_per_s = speed.ok() ? *speed : -1;
  facts.free_bytes = static_cast<std::int64_t>(
      runtime::DiskReserve(folder, storage::Disk::kernel(), rig.recording.volumes).free_bytes());
  for (const std::string& volume : rig.recording.volumes)
    if (const std::string trouble = storage::volume_trouble(volume, folder); !trouble.empty())
      findings.push_back({false, "disk", volume + " " + trouble, "mend it, or take it out of recording.volumes"});
  if (!speed.ok()) {
    findings.push_back({true, "disk", speed.error().message, "check the folder, its rights and its room"});
    if (is_live)
      findings.push_back({true, "sensors", "nobody has listened to them, because what they send cannot be written",
                          "check again when the disk takes data"});
  }

  if (is_live && speed.ok()) {
    const PassingFile recording(folder / fmt::format(".hueline-check-{}.mcap", getpid()));
    auto journal = storage::SegmentedJournal::create(recording.path(), runtime::journal_header(rig));
    if (!journal.ok()) {
      log_error(journal.error().message);
      return kOutputRefused;
    }
    Heard heard(rig);
    runtime::Pipeline pipeline(rig, options.threads, heard);
    const BufferPool pool(std::size_t{512} << 20);
    std::vector<runtime::LiveRun::Source> sources;
    for (const auto& sensor : rig.sensors) {
      runtime::Reader::Config reader;
      reader.silent_after = std::chrono::milliseconds(static_cast<std::int64_t>(sensor.silent_after_s * 1000));
      sources.push_back({sensor.id, sensor.name, sensor.device->make_source(pool), reader, sensor.type->is_sheddable});
    }
    runtime::LiveRun run(std::move(sources), std::make_unique<storage::SegmentedJournal>(std::move(*journal)),
                         [&](const Packet& packet) { pipeline.process(packet); }, {});
    log_info("listening to the sensors of {} for {:.0f} s", rig.name, options.seconds);
    const HostTime begin = drivers::host_now();
    run.start();
    const auto passed = [&] { return to_seconds(drivers::host_now() - begin); };
    while (passed() < options.seconds && !run.wait_until_over(std::chrono::milliseconds(500), signals.asked())) {
      if (signals.asked().stop_requested()) break;
      run.ingest().submit(Packet{kSystemSensor, PacketKind::Tick, false, 0, drivers::host_now(), {}});
    }
    const double seconds = std::max(passed(), 0.1);
    run.stop(signals.at_once());
    pipeline.flush();
    for (const auto& sensor : rig.sensors) {
      const auto counts = run.ingest().counts(sensor.id);
      facts.recorded_bytes_per_s += static_cast<double>(counts.bytes) / seconds;
      if (!pipeline.health().has_come(sensor.id)) {
        if (!options.is_json) fmt::print("{:10} not there\n", sensor.name);
        findings.push_back({true, sensor.name, heard.why_not(sensor.id), "check power, cable, address and port"});
        continue;
      }
      const std::string heard_of = fmt::format(
          "{:8.1f} packets/s {:8.2f} MB/s  {}", static_cast<double>(counts.packets) / seconds,
          static_cast<double>(counts.bytes) / seconds * 1e-6, runtime::name(pipeline.health().level(sensor.id)));
      if (!options.is_json) fmt::print("{:10} {}\n", sensor.name, heard_of);
      present.push_back({{"name", sensor.name}, {"state", "ok"}, {"text", heard_of}, {"action", ""}});
    }
    facts.points_per_s = heard.points() / seconds;
    lenses = heard.lenses();
    for (auto& finding : runtime::check_light(lenses)) findings.push_back(std::move(finding));
    for (auto& finding : runtime::check_sensors(rig, pipeline.health())) findings.push_back(std::move(finding));
    if (signals.asked().stop_requested()) return kStopped;
  }
  for (auto& finding : runtime::check_host(rig, facts, options.hours)) findings.push_back(std::move(finding));

  std::stable_sort(findings.begin(), findings.end(),
                   [](const runtime::Finding& a, const runtime::Finding& b) { return a.prevents > b.prevents; });
  if (options.is_json) {
    nlohmann::ordered_json items = nlohmann::ordered_json::array();
    bool is_ready = true;
    for (const runtime::Finding& one : findings) {
      is_ready = is_ready && !one.prevents;
      items.push_back({{"name", one.about},
                       {"state", one.prevents ? "missing" : "remark"},
                       {"text", one.text},
                       {"action", one.action}});
    }
    // A sensor with a finding is not ok.
    for (auto& one : present)
      if (std::none_of(findings.begin(), findings.end(), [&](const auto& found) { return found.about == one["name"]; }))
        items.push_back(std::move(one));
    nlohmann::ordered_json light = nlohmann::ordered_json::array();
    for (const runtime::LensLight& one : lenses)
      light.push_back({{"camera", one.camera},
                       {"lens", one.lens},
                       {"median", one.median()},
                       {"dark_share", one.dark_share()},
                       {"saturated_share", one.saturated_share()},
                       {"histogram", one.pixels}});
    const nlohmann::ordered_json out = {
        {"rig", rig.name}, {"ready", is_ready}, {"items", items}, {"lenses", light}, {"checklist", rig.checklist}};
    fmt::print("{}\n", json_text(out, 2));
    return is_ready ? kDone : kNotReady;
  }
  for (const runtime::LensLight& one : lenses)
    fmt::print("{:10} test exposure: median {:3} of 255, {:4.1f} % dark, {:4.1f} % saturated\n", one.lens, one.median(),
               100 * one.dark_share(), 100 * one.saturated_share());
  for (const std::string& item : rig.checklist) fmt::print("by hand: {}\n", item);
  const auto missing = std::count_if(findings.begin(), findings.end(), [](const auto& one) { return one.prevents; });
  for (const runtime::Finding& one : findings)
    fmt::print("{} {}: {}; {}\n", one.prevents ? "MISSING" : "remark ", one.about, one.text, one.action);
  if (missing > 0)
    fmt::print("not ready: {} thing{} must be mended first\n", missing, missing == 1 ? "" : "s");
  else
    fmt::print("ready{}\n", findings.empty() ? "" : ", with remarks");
  return missing > 0 ? kNotReady : kDone;
}

}  // namespace

void add_check(Command& all) {
  auto options = std::make_shared<CheckOptions>();
  Command command = all.command(
      "check", "before a drive: check rig, sensors, clocks, disk and computer, and say ready or what is missing");
  command.required("RIG", options->rig, "rig file (YAML), or the name of a rig that comes with the program");
  command.option("--disk", options->disk, "folder in which the drive will be recorded; it is tried with 64 MB");
  command.setting("--hours", options->hours, "how long the drive will be, for the room on the disk", {0.0, 1000.0});
  command.setting("--seconds", options->seconds, "how long the sensors are listened to", {3.0, 600.0});
  command.flag("--json", options->is_json, "print the findings as JSON");
  command.footer(
      "Nothing is kept of what the sensors send.\n"
      "Example: hueline check rig.yaml --disk drives --hours 4\n"
      "Exit status: 0 if the drive may start; 9 if not.\n"
      "More: docs/operating.md");
  command.reads(options->rig);
  command.runs([options] { return check(*options); });
}

}  // namespace hueline::apps
