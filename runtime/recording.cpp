#include "runtime/recording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "config/section.hpp"
#include "core/input_folder.hpp"
#include "core/output_file.hpp"
#include "core/remote_store.hpp"
#include "runtime/version.hpp"

namespace hueline::runtime {

namespace {
constexpr std::chrono::milliseconds kFollowEvery{100};  // at a recording that is followed
}

storage::JournalHeader journal_header(const config::Rig& rig) {
  storage::JournalHeader header;
  header.sensors.push_back({"hueline", "hueline"});
  for (const auto& sensor : rig.sensors) header.sensors.push_back({sensor.name, sensor.driver()});
  header.files.push_back({"rig.yaml", "application/yaml", rig.text});
  header.about = {{"program_version", kVersion}, {"git_revision", kGitRevision}, {"rig", rig.name}};
  header.has_packed_images = rig.recording.pack_images;
  return header;
}

std::string drive_file(const std::string& path, const char* name) {
  return holds(path, name) ? (std::filesystem::path(path) / name).string() : path;
}

std::string drive_cloud(const std::string& path) {
  std::string found = path;
  for (const char* file : storage::kCloudFiles) found = drive_file(found, file);
  return found;
}

Result<std::unique_ptr<storage::JournalReader>> open_journal(const std::string& named) {
  const std::string path = drive_file(named);
  if (is_folder(path))
    return Error{ErrorCode::Io, path + " is a folder without drive.mcap in it: give a recording, or a drive's folder"};
  return storage::JournalReader::open(path);
}

Result<std::string> find_cloud(const std::string& named) {
  const std::string path = drive_cloud(named);
  if (!is_folder(path)) return path;
  const bool is_running = !is_address(path) && OutputFolder::is_held_by_another(path);
  const std::string what = is_running ? "a capture or replay is writing there, and has placed no point yet"
                           : holds(path, "drive.mcap") ? fmt::format("`hueline replay {0} --out {0}` makes one", path)
                                                       : "give a cloud, or a drive's folder";
  return Error{ErrorCode::Io, fmt::format("{} is a folder without a cloud ({}) in it: {}", path,
                                          fmt::join(storage::kCloudFiles, ", "), what)};
}

Result<Recording> Recording::open(const std::string& named, const std::string& rig_file) {
  const std::string path = drive_file(named);
  auto journal = open_journal(named);
  if (!journal.ok()) return journal.error();
  const storage::JournalHeader& header = (*journal)->header();
  Recording out;
  if (!rig_file.empty()) {
    out.rig = config::load_rig(rig_file);
  } else {
    const std::string* text = nullptr;
    for (const auto& file : header.files)
      if (file.name == "rig.yaml") text = &file.text;
    if (!text) return Error{ErrorCode::Malformed, fmt::format("{}: holds no rig.yaml; give one with --rig", path)};
    try {
      out.rig = config::parse_rig(*text, path + ":rig.yaml");
    } catch (const config::ConfigError& e) {
      return Error{ErrorCode::Unsupported,
                   fmt::format("{}; the recording is of another version: give a rig with --rig", e.what())};
    }
  }
  const auto names = out.rig.sensor_names();
  bool same = names.size() == header.sensors.size();
  for (std::size_t i = 0; same && i < names.size(); ++i) same = names[i] == header.sensors[i].name;
  if (!same) {
    std::string recorded;
    for (const auto& sensor : header.sensors) recorded += " " + sensor.name;
    return Error{ErrorCode::Invalid,
                 fmt::format("{}: the rig's sensors are not those of the recording:{}", path, recorded)};
  }
  out.journal = std::move(*journal);
  return out;
}

Status Recording::for_each(const std::function<bool(const Packet&)>& use) {
  Status first;
  for (;;) {
    Result<Packet> packet = journal->next(follows.value_or(std::stop_token()));
    if (packet.ok()) {
      if (!use(*packet)) return first;
      continue;
    }
    const Error& error = packet.error();
    const bool is_end = error.code == ErrorCode::EndOfData || error.code == ErrorCode::Truncated;
    if (is_end && follows && is_more_coming()) continue;
    if (error.code == ErrorCode::EndOfData) return first;
    if (first.ok() || error.code == ErrorCode::Io) first = error;
    if (error.code != ErrorCode::Malformed) return first;
  }
}

/// At an end of what is there: waits for more. Returns false if none can come.
bool Recording::is_more_coming() {
  const std::filesystem::path file = journal->segments().front().path;
  for (;;) {
    // Asked before the file is looked at: what the capture wrote last is there when it is gone.
    const bool is_written = OutputFolder::is_held_by_another(file.parent_path());
    if (journal->look_again()) return true;
    if (journal->is_closed() || !is_written) return false;
    if (follows->stop_requested()) return true;  // next() says so
    std::this_thread::sleep_for(kFollowEvery);
  }
}

void wait_for_recording(const std::string& named, const std::stop_token& stop) {
  const std::filesystem::path file = drive_file(named);
  // A folder whose capture has not made its file yet.
  const std::filesystem::path folder = is_folder(file) ? file : file.parent_path();
  while (!stop.stop_requested() && OutputFolder::is_held_by_another(folder) && !open_journal(named).ok())
    std::this_thread::sleep_for(kFollowEvery);
}

Status for_each_solution(const config::Rig& rig,
                         const std::function<Status(const std::function<bool(const Packet&)>& take)>& feed,
                         const std::function<void(const InsSolution&)>& use) {
  std::unique_ptr<Decoder> decoder;
  for (const auto& sensor : rig.sensors)
    if (sensor.id == rig.sync.pos) decoder = sensor.device->make_decoder();
  if (!decoder) return {};
  std::optional<InsUncertainty> uncertainty;
  std::vector<Measurement> measurements;
  const auto take = [&] {
    for (Measurement& measurement : measurements) {
      if (const auto* sigma = std::get_if<InsUncertainty>(&measurement)) uncertainty = *sigma;
      auto* solution = std::get_if<InsSolution>(&measurement);
      if (solution == nullptr) continue;
      if (!solution->sigma && uncertainty) solution->sigma = uncertainty->sigma;
      use(*solution);
    }
    measurements.clear();
  };
  const Status read = feed([&](const Packet& packet) {
    if (packet.sensor != rig.sync.pos || packet.shed || packet.kind != PacketKind::Wire) return true;
    decoder->decode(packet, measurements);
    take();
    return true;
  });
  decoder->flush(measurements);
  take();
  return read;
}

Status for_each_solution(Recording& recording, const std::function<void(const InsSolution&)>& use) {
  recording.journal->read_only({recording.rig.sync.pos});
  const Status read = for_each_solution(
      recording.rig, [&](const auto& take) { return recording.for_each(take); }, use);
  recording.journal->read_only({});
  return read;
}

}  // namespace hueline::runtime
