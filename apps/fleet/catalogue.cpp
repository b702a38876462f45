#include "apps/fleet/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "apps/fleet/catalogue_table.hpp"
#include "apps/fleet/geopackage.hpp"
#include "apps/fleet/json_file.hpp"
#include "apps/sha256.hpp"
#include "config/section.hpp"
#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/printable.hpp"
#include "runtime/drive_map.hpp"
#include "runtime/health.hpp"
#include "runtime/recording.hpp"
#include "storage/cloud_format.hpp"
#include "storage/journal_segments.hpp"

namespace hueline::apps {
namespace {

namespace fs = std::filesystem;

void note(CatalogueEntry& entry, const std::string& trouble) {
  entry.text += (entry.text.empty() ? "" : "; ") + printable(trouble);
}

std::optional<CatalogueWatch> watch_of(const nlohmann::ordered_json& summary) {
  const auto at = [&](const std::string& key) {
    return number_at(summary, ("/watch/last_window/against_rig/" + key).c_str());
  };
  CatalogueWatch out;
  for (std::size_t i = 0; i < out.turn_deg.size(); ++i) {
    const auto turn = at(fmt::format("turn_deg/{}", i)), sigma = at(fmt::format("turn_sigma_deg/{}", i));
    if (!turn || !sigma) return {};
    out.turn_deg[i] = *turn;
    out.turn_sigma_deg = std::max(out.turn_sigma_deg, *sigma);
  }
  out.late_ms = at("late_ms").value_or(0);
  out.late_sigma_ms = at("late_sigma_ms").value_or(0);
  return out;
}

/// Takes the figures of a drive from its summary.json.
void read_summary(CatalogueEntry& entry, const fs::path& folder) {
  const auto root = read_json(folder / "summary.json", "a summary");
  if (!root.ok()) return note(entry, root.error().message);
  entry.verdict = text_at(*root, "/verdict/grade");
  entry.begin = text_at(*root, "/drive/begin");
  entry.end = text_at(*root, "/drive/end");
  entry.duration_s = number_at(*root, "/drive/duration_s");
  entry.path_m = number_at(*root, "/drive/path_m");
  entry.coloured_share = number_at(*root, "/points/coloured_share");
  if (const auto points = number_at(*root, "/points/total")) entry.points = static_cast<std::int64_t>(*points);
  entry.watch = watch_of(*root);
  for (const auto& remark : items_at(*root, "/verdict/remarks"))
    entry.reasons.push_back(printable(text_at(remark, "/sensor") + ": " + text_at(remark, "/text")));
  for (const auto& one : items_at(*root, "/health")) {
    const std::string level = text_at(one, "/level");
    if (level != runtime::name(runtime::HealthLevel::Warning) && level != runtime::name(runtime::HealthLevel::Alarm))
      continue;
    entry.troubles.push_back({printable(text_at(one, "/sensor")), printable(text_at(one, "/trouble")),
                              printable(text_at(one, "/cause")),
                              number_at(one, "/end_s").value_or(0) - number_at(one, "/begin_s").value_or(0)});
  }
}

/// Returns the bytes of a recording's segments; nothing if they cannot be told.
std::optional<std::int64_t> recorded_bytes(const std::string& recording) {
  const auto segments = storage::find_segments(recording);
  if (!segments.ok()) return {};
  std::int64_t out = 0;
  for (const storage::Segment& segment : *segments) {
    const auto opened = InputFile::open(segment.path);
    if (!opened.ok()) return {};
    out += static_cast<std::int64_t>(opened->size());
  }
  return out;
}

/// Takes rig and places from the recording. `rig` is the file that replaces the recorded one; empty: none does.
void read_recording(CatalogueEntry& entry, const std::string& rig) {
  try {
    auto recording = runtime::Recording::open(entry.recording, rig);
    if (!recording.ok()) return note(entry, recording.error().message);
    entry.rig = recording->rig.name;
    entry.rig_sha256 = sha256_of_text(recording->rig.text);
    runtime::DriveMap map;
    const Status read = runtime::for_each_solution(
        recording->rig, [&](const auto& take) { return recording->for_each(take); },
        [&](const InsSolution& solution) { map.on_solution(solution); });
    if (!read.ok()) note(entry, read.error().message);
    for (const runtime::DriveMap::Second& second : map.seconds())
      if (second.place) entry.places.push_back(*second.place);
  } catch (const config::ConfigError& e) {
    note(entry, e.what());
  }
}

/// Returns the names of what a replay may have written into a drive's folder.
std::vector<std::string> product_files(const fs::path& folder) {
  std::vector<std::string> out{"cloud.copc.laz", "cloud.las",    "cloud.laz", "report.html",
                               "report.pdf",     "summary.json", "view.mcap"};
  std::error_code failed;
  const fs::path parts = storage::kPartsFolder;
  for (fs::directory_iterator at(folder / parts, failed), end; !failed && at != end; at.increment(failed))
    if (at->is_regular_file()) out.push_back((parts / at->path().filename()).string());
  return out;
}

}  // namespace

CatalogueEntry entry_of(const FleetPlan& plan, const FleetTask& task) {
  CatalogueEntry entry;
  entry.name = task.name;
  entry.key = results_of(plan, task).string();
  entry.recording = task.recording().string();
  entry.program = fmt::format("{} ({})", plan.version, plan.git_revision);
  std::string rig;
  for (const FleetInput& input : task.inputs) {
    if (input.role == InputRole::Rig) rig = input.file.string();
    if (input.role == InputRole::Trajectory) entry.trajectory_sha256 = input.sha256;
    if (input.role == InputRole::Recording)
      entry.recording_bytes = entry.recording_bytes.value_or(0) + static_cast<std::int64_t>(input.bytes);
  }
  auto result = finished_result(plan, task, Check::Sizes);
  if (result) {
    entry.results = results_of(plan, task).string();
    entry.fusion_s = result->seconds;
    entry.products = std::move(result->products);
    read_summary(entry, entry.results);
  } else {
    result = failed_result(plan, task);
  }
  entry.status = result ? name(result->end) : "open";
  if (result && !result->text.empty()) note(entry, result->text);
  read_recording(entry, rig);
  return entry;
}

Status check_is_there(const std::string& drive) {
  const std::string recording = runtime::drive_file(drive);
  if (is_folder(recording))
    return Error{ErrorCode::Io,
                 recording + " is a folder without drive.mcap in it: give a recording, or a drive's folder"};
  const auto opened = InputFile::open(recording);
  return opened.ok() ? Status() : Status(opened.error());
}

CatalogueEntry entry_of(const std::string& drive) {
  CatalogueEntry entry;
  const fs::path recording = absolute_name(runtime::drive_file(absolute_name(drive).string()));
  const fs::path folder = recording.parent_path();
  entry.key = entry.recording = recording.string();
  entry.status = "driven";
  entry.recording_bytes = recorded_bytes(entry.recording);
  if (recording.stem() == "drive" && holds(folder, "summary.json")) {
    entry.name = folder.filename().string();
    entry.results = folder.string();
    read_summary(entry, folder);
    for (const std::string& file : product_files(folder)) {
      if (!holds(folder, file)) continue;
      const auto opened = InputFile::open(folder / file);
      auto hash = sha256_of(folder / file);
      if (opened.ok() && hash.ok())
        entry.products[file] = {opened->size(), std::move(*hash)};
      else
        note(entry, opened.ok() ? hash.error().message : opened.error().message);
    }
  } else {
    entry.name = recording.stem() == "drive" ? folder.filename().string() : recording.stem().string();
  }
  read_recording(entry, {});
  return entry;
}

Result<std::string> geopackage_of(const std::vector<CatalogueEntry>& entries) {
  GeoPackage out;
  out.add_lines(drives_table());
  out.add_table(products_table());
  // The end of the latest drive, not the time of this run: the same drives give the same catalogue.
  std::string newest = "1970-01-01T00:00:00.000Z";
  for (const CatalogueEntry& one : entries) {
    newest = std::max(newest, one.end);
    const std::int64_t drive = out.add_line(drives_table().name, one.places, drive_row(one));
    for (const auto& [file, product] : one.products)
      out.add_row(products_table().name, product_row(drive, file, product));
  }
  return out.bytes(newest);
}

}  // namespace hueline::apps
