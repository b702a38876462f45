#include "runtime/outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "core/calendar.hpp"
#include "core/json_text.hpp"
#include "runtime/report_content.hpp"
#include "runtime/view_rig.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/cloud_parts.hpp"
#include "storage/las_writer.hpp"
#include "storage/part_index.hpp"

namespace hueline::runtime {
namespace {

using storage::kPartsFolder;

}  // namespace

/// A line of one of the two logs of the view.
struct Outputs::Line {
  std::optional<GpsTime> time;
  storage::ViewWriter::Level level;
  std::string who, text;
  bool is_health = false;
};

struct Outputs::Files {
  storage::LasWriter::Config las_config;
  std::optional<storage::LasWriter> las;
  Status las_failure;  // why the cloud ends early
  bool las_closed = false;
  std::optional<OutputFolder> parts_folder;
  std::optional<storage::CloudParts> parts;  // of the rig's cloud.split, from the first point to the cloud's end
  bool parts_failed = false;
  std::optional<Summary::Parts> parts_written;
  std::optional<storage::PathStrips> path;  // of strips by distance
  std::size_t strips_ended = 0;             // of them, the parts know
  std::optional<storage::ViewWriter> view;  // exists after the first good solution; its frame is the cloud's origin
  bool view_failed = false;
  std::deque<Line> early;  // log lines until there are a view and a time at which to show them
  std::vector<std::string> sensors;
};

Outputs::Outputs(const config::Rig& rig, OutputFolder folder, Tell tell)
    : folder_(std::move(folder)),
      dir_(folder_->path()),
      tell_(std::move(tell)),
      rig_(rig),
      summary_(rig.sensor_names()),
      files_(std::make_unique<Files>()) {
  files_->las_config.map = rig.map;
  files_->las_config.format = rig.cloud_format;
  files_->las_config.threads = 2;  // beside the thread that writes; LAS does not use them
  if (rig.cloud_split && rig.cloud_split->kind == storage::CloudSplit::Kind::Distance)
    files_->path.emplace(rig.cloud_split->size);
  files_->sensors = rig.sensor_names();
  for (const fusion::LensMount& lens : rig.geometry.head.lenses) cameras_.push_back(lens.camera);
}

Outputs::~Outputs() = default;

Result<std::unique_ptr<Outputs>> Outputs::create(const config::Rig& rig, const std::filesystem::path& dir, Tell tell) {
  auto folder = OutputFolder::open(dir);
  if (!folder.ok()) return folder.error();
  for (const char* file : {rig.cloud_file(), "view.mcap", "summary.json", "report.html", "report.pdf"})
    if (Status done = check_output(dir / file); !done.ok()) return done.error();
  if (rig.cloud_split)
    if (Status done = check_output_folder(dir / kPartsFolder); !done.ok()) return done.error();
  return std::unique_ptr<Outputs>(new Outputs(rig, std::move(*folder), std::move(tell)));
}

void Outputs::keep(const char* file, Status done) {
  if (done.ok()) return;
  tell_(fmt::format("{}: {}; the raw recording goes on", file, done.error().message));
  if (first_error_.ok()) first_error_ = std::move(done);
}

/// Returns false once the disk's last space is reached. What follows is left to a replay, so the files hold the
/// beginning of what the replay writes.
bool Outputs::has_room() {
  if (is_reserved_ || reserve_ == nullptr) return !is_reserved_;
  const Status room = reserve_->check(dir_ / rig_.cloud_file());
  if (room.ok()) return true;
  is_reserved_ = true;
  keep((rig_.cloud_file() + std::string(rig_.cloud_split ? ", parts, view.mcap" : ", view.mcap")).c_str(),
       Error{ErrorCode::Exhausted, room.error().message + ": they end here, a replay makes them whole"});
  close_cloud();  // now, because what a COPC file still needs is not small, and the recording's end comes last
  return false;
}

void Outputs::close_cloud() {
  if (files_->las && files_->las_failure.ok() && !std::exchange(files_->las_closed, true))
    keep(rig_.cloud_file(), files_->las->close());
  end_parts();
}

/// Begins to write the parts of the cloud, which has been created.
void Outputs::begin_parts() {
  const auto fail = [&](Status why) {
    files_->parts_failed = true;
    keep(kPartsFolder, std::move(why));
  };
  auto folder = OutputFolder::open(dir_ / kPartsFolder);
  if (!folder.ok()) return fail(folder.error());
  // What an earlier run left there is of another cloud.
  const auto removed = storage::remove_parts(folder->path(), storage::EarlierParts::All);
  if (!removed.ok()) return fail(removed.error());
  const storage::LasWriter& las = *files_->las;
  const auto unit = storage::crs_unit(las.projection().operation().wkt());
  if (!unit.ok()) return fail(unit.error());
  storage::CloudParts::Config config;
  config.split = *rig_.cloud_split;
  config.tile_edge = config.split.size / unit->metres;
  config.header = las.header();
  config.records = las.records();
  config.threads = files_->las_config.threads;
  auto parts = storage::CloudParts::create(folder->path(), std::move(config));
  if (!parts.ok()) return fail(parts.error());
  files_->parts_folder.emplace(std::move(*folder));
  files_->parts.emplace(std::move(*parts));
  files_->las->also_give([this](storage::ByteView records) { add_to_parts(records); });
}

void Outputs::add_to_parts(storage::ByteView records) {
  if (!files_->parts || files_->parts_failed) return;
  if (files_->path)
    for (const auto& ends = files_->path->ends(); files_->strips_ended < ends.size(); ++files_->strips_ended)
      files_->parts->end_strip(ends[files_->strips_ended]);
  if (Status added = files_->parts->add(records); !added.ok()) {
    files_->parts_failed = true;
    keep(kPartsFolder, std::move(added));
  }
}

/// Finishes the parts, after the cloud, and writes their index.
void Outputs::end_parts() {
  if (!files_->parts) return;
  storage::CloudParts parts = std::move(*files_->parts);
  files_->parts.reset();
  Status finished = parts.finish();
  if (finished.ok()) {
    const auto indexed = storage::write_part_index(dir_ / kPartsFolder / storage::kPartIndex, parts.parts(),
                                                   files_->las->projection().operation().wkt());
    if (!indexed.ok()) finished = indexed.error();
  }
  if (!files_->parts_failed) keep(kPartsFolder, std::move(finished));  // it was told otherwise
  Summary::Parts written;
  written.split = rig_.cloud_split->text();
  written.folder = kPartsFolder;
  written.files = parts.parts().size();
  for (const storage::CloudPart& part : parts.parts()) {
    written.points += part.points;
    written.bytes += part.bytes;
  }
  files_->parts_written = std::move(written);
}

template <class Append>
void Outputs::view(Append append) {
  if (!files_->view || files_->view_failed || !has_room()) return;
  if (Status done = append(*files_->view); !done.ok()) {
    files_->view_failed = true;
    keep("view.mcap", done);
  }
}

void Outputs::log(Line line) {
  constexpr std::size_t kEarly = 1000;  // the summary has the counts of all faults
  if (!line.time) line.time = newest_;
  if (files_->view && line.time) {
    view([&](auto& out) {
      return line.is_health ? out.append_health(*line.time, line.level, line.who, line.text)
                            : out.append_log(*line.time, line.level, line.who, line.text);
    });
  } else if (!files_->view_failed && files_->early.size() < kEarly) {
    files_->early.push_back(std::move(line));
  }
}

void Outputs::on_origin(const Geodetic& origin) {
  auto created = storage::ViewWriter::create(dir_ / "view.mcap", origin, view_rig(rig_), {});
  if (created.ok()) {
    files_->view.emplace(std::move(*created));
  } else {
    files_->view_failed = true;
    keep("view.mcap", created.error());
  }
}

void Outputs::on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) {
  summary_.on_cloud(block, trajectory);
  map_.on_cloud(block);
  if (!has_room()) return;
  view([&](auto& out) { return out.append(block); });
  if (!files_->las_failure.ok() || block.points.empty()) return;
  if (!files_->las) {
    // This is the date of the drive, not of the run, because a replay must give the same bytes.
    files_->las_config.created = to_utc(block.points.front().time);
    auto las = storage::LasWriter::create(dir_ / rig_.cloud_file(), block.origin, files_->las_config);
    if (!las.ok()) {
      files_->las_failure = las.error();
      keep(rig_.cloud_file(), las.error());
      return;
    }
    files_->las.emplace(std::move(*las));
    // What an earlier run said at its end is not said of this cloud. That it is missing says that this run has not come
    // to its end.
    std::error_code ignored;
    for (const char* file : {"summary.json", "report.html", "report.pdf"})
      std::filesystem::remove(dir_ / file, ignored);
    if (rig_.cloud_split) begin_parts();
    const storage::MapOperation& map = files_->las->projection().operation();
    summary_.on_map({map.crs(), map.name(), map.words()});
  }
  if (Status done = files_->las->append(block); !done.ok()) {
    files_->las_failure = done;
    keep(rig_.cloud_file(), done);
  }
}

void Outputs::on_exposure(const Exposure& exposure) {
  summary_.on_exposure(exposure);
  view([&](auto& out) { return out.append(exposure, files_->sensors.at(exposure.camera)); });
}
void Outputs::on_solution(const InsSolution& solution) {
  summary_.on_solution(solution);
  map_.on_solution(solution);
  newest_ = solution.time;
  if (files_->path) files_->path->add(solution);
  if (files_->view)
    for (auto early = std::exchange(files_->early, {}); auto& line : early) log(std::move(line));
  view([&](auto& out) { return out.append(solution); });
}
void Outputs::on_fix(const GnssFix& fix) {
  map_.on_fix(fix);
  view([&](auto& out) { return out.append(fix); });
}
void Outputs::on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) {
  summary_.on_sync_state(time, clock, state);
  log({time, storage::ViewWriter::Level::Info, files_->sensors.at(clock), name(state)});
}
void Outputs::on_fault(const Fault& fault) {
  summary_.on_fault(fault);
  const std::string& who = files_->sensors.at(fault.sensor < files_->sensors.size() ? fault.sensor : kSystemSensor);
  const bool is_drift =
      fault.kind == FaultKind::Implausible && std::ranges::find(cameras_, fault.sensor) != cameras_.end();
  if (is_drift) tell_(fmt::format("{}: {}", who, fault.detail));
  log({{},
       storage::ViewWriter::Level::Warning,
       who,
       fmt::format("{} x{}: {}", name(fault.kind), fault.count, fault.detail)});
}
void Outputs::on_health(const HealthChange& change) {
  using Level = storage::ViewWriter::Level;
  const Level level = change.level == HealthLevel::Alarm     ? Level::Error
                      : change.level == HealthLevel::Warning ? Level::Warning
                                                             : Level::Info;
  log({change.time, level, change.sensor == kSystemSensor ? "drive" : files_->sensors.at(change.sensor), text(change),
       true});
  if (tell_health_) tell_health_(change);
}

void Outputs::on_command(const OperatorCommand& command) {
  summary_.on_command(command);
  log({command.time, storage::ViewWriter::Level::Info, "operator", text(command)});
}

Status Outputs::finish(const Health* health) {
  close_cloud();
  const bool ended_early = std::exchange(is_reserved_, false);
  reserve_ = nullptr;  // the ends of the files are small
  view([](auto& out) { return out.close(); });
  const storage::LasWriter::Counts counts = files_->las ? files_->las->counts() : storage::LasWriter::Counts{};
  summary_.on_unwritten("outside the map's projection", counts.refused);
  // After the first failure nothing more is offered to the file.
  if (ended_early) {
    summary_.on_early_end("the disk's last space was kept for the recording: a replay makes cloud and view whole");
    summary_.on_unwritten("left out to keep the disk's last space for the recording",
                          summary_.points() - (counts.written + counts.refused));
  } else if (const Status& failure = files_->las_failure; !failure.ok()) {
    summary_.on_unwritten(failure.error().message, summary_.points() - (counts.written + counts.refused));
  }
  if (auto& parts = files_->parts_written) {
    parts->missing = summary_.points() - counts.refused - parts->points;
    summary_.on_parts(std::move(*parts));
  } else {
    const auto removed = storage::remove_parts(dir_ / kPartsFolder, storage::EarlierParts::All);
    if (!removed.ok()) keep(kPartsFolder, removed.error());
    std::error_code error;
    std::filesystem::remove(dir_ / kPartsFolder, error);  // only if it is empty
  }
  // If this run has no content for a file, the content of an earlier run must not stay there.
  for (const char* file : storage::kCloudFiles) {
    const auto other_cloud = dir_ / file;
    if (std::error_code error;
        file != std::string_view(rig_.cloud_file()) && !std::filesystem::remove(other_cloud, error) && error)
      keep(file, io_error("remove " + other_cloud.string(), error.value()));
  }
  if (!files_->las && files_->las_failure.ok())
    keep(rig_.cloud_file(), write_output(dir_ / rig_.cloud_file(), std::string_view()));
  if (!files_->view && !files_->view_failed) keep("view.mcap", write_output(dir_ / "view.mcap", std::string_view()));
  if (health != nullptr) {
    summary_.on_verdict(*health, judge_drive(rig_, *health, summary_));
    const ReportContent report = report_content(rig_, *summary_.verdict(), summary_, map_);
    keep("report.html", write_output(dir_ / "report.html", report_html(report)));
    keep("report.pdf", write_output(dir_ / "report.pdf", report_pdf(report)));
  }
  keep("summary.json", write_output(dir_ / "summary.json", json_text(summary_.json(), 2) + "\n"));
  folder_.reset();
  return first_error_;
}

}  // namespace hueline::runtime
