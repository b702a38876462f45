#include "apps/calibrate/calibrate_targets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/calibrate/calibrate.hpp"
#include "apps/calibrate/station_scan.hpp"
#include "apps/exit_code.hpp"
#include "apps/input_error.hpp"
#include "apps/log.hpp"
#include "calibration/targets/targets_report.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"
#include "runtime/version.hpp"

namespace hueline::apps {
namespace {

using namespace calibration;
namespace fs = std::filesystem;

struct CalibrateTargetsOptions {
  std::string targets, stations, out, format, write = "none", method = "known-radius", date;
  std::vector<std::string> scans;
  double radius_m = 0, survey_sigma_mm = 3, precision_mm = 5, accuracy_mm = 8, angle_urad = 17.5, ring_radii = 3,
         station_doubt_m = 0.05, most_tilt_deg = 45;
  int threads = 2;
  bool scale = false, time_reading = false;
};

double seconds_of(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TargetsConfig config_of(const CalibrateTargetsOptions& options) {
  TargetsConfig config;
  config.method = options.method == "published" ? CentreMethod::LinearFit : CentreMethod::KnownRadius;
  config.noise = {options.precision_mm / 1000, options.accuracy_mm / 1000, options.angle_urad * 1e-6};
  config.detection.ring_radii = options.ring_radii;
  config.station_doubt_m = options.station_doubt_m;
  config.most_tilt_deg = options.most_tilt_deg;
  config.estimate_scale = options.scale;
  config.threads = static_cast<unsigned>(options.threads);
  if (const std::string wrong = config.validate(); !wrong.empty()) throw config::ConfigError(wrong);
  return config;
}

/// Returns the scan file of each station: from STATION=FILE on the command line, otherwise from the stations' column
/// `scan`, relative to their file.
std::map<std::string, std::string> scans_of(const CalibrateTargetsOptions& options,
                                            const std::vector<SurveyedStation>& stations) {
  std::map<std::string, std::string> out;
  for (const SurveyedStation& station : stations)
    if (!station.scan.empty()) out[station.name] = (fs::path(options.stations).parent_path() / station.scan).string();
  if (!options.scans.empty()) out.clear();
  for (const std::string& word : options.scans) {
    const std::size_t equal = word.find('=');
    const std::string name = word.substr(0, equal);
    if (equal == std::string::npos || std::ranges::none_of(stations, [&](const auto& s) { return s.name == name; }))
      throw config::ConfigError(
          fmt::format("--scan '{}': allowed: STATION=FILE with a station of {}", word, options.stations));
    out[name] = word.substr(equal + 1);
  }
  return out;
}

/// Returns the time of reading the file alone, the fastest of three. It is the lower limit of the whole run.
double time_of_reading(const std::string& path) {
  double fastest = 1e9;
  for (int i = 0; i < 3; ++i)
    fastest = std::min(fastest, seconds_of([&] {
                         const auto file = InputFile::open(path);
                         if (!file.ok()) return;
                         std::vector<std::byte> block(1 << 20);
                         for (std::uint64_t at = 0; at < file->size(); at += block.size())
                           if (!file->read(at, std::span(block).first(static_cast<std::size_t>(
                                                   std::min<std::uint64_t>(block.size(), file->size() - at))))
                                    .ok())
                             return;
                       }));
  return fastest;
}

UtcTime utc_of(const std::string& date) {
  UtcTime t;
  if (std::sscanf(date.c_str(), "%d-%d-%d", &t.year, &t.month, &t.day) != 3 || !from_utc(t))
    throw config::ConfigError(fmt::format("--date is '{}'; allowed: YYYY-MM-DD", date));
  return t;
}

/// What the surveyor gives: targets, stations, and the scan file of each station.
struct Survey {
  std::vector<SurveyedTarget> targets;
  std::vector<SurveyedStation> stations;
  std::map<std::string, std::string> scans;  ///< by name of the station
};

/// Reads both tables. Throws InputError if one cannot be read, and config::ConfigError if a table is wrong, or if they
/// do not fit to each other and to the scans.
Survey read_survey(const CalibrateTargetsOptions& options) {
  const auto targets =
      parse_targets(read_table(options.targets), options.targets, {options.survey_sigma_mm / 1000, options.radius_m});
  const auto stations = parse_stations(read_table(options.stations), options.stations);
  if (!targets.ok()) throw config::ConfigError(targets.error().message);
  if (!stations.ok()) throw config::ConfigError(stations.error().message);
  for (const SurveyedTarget& target : *targets)
    for (const std::string& name : target.stations)
      if (std::ranges::none_of(*stations, [&](const auto& s) { return s.name == name; }))
        throw config::ConfigError(fmt::format("{}: target {} names station {}, which {} does not have", options.targets,
                                              target.name, name, options.stations));
  Survey survey{*targets, *stations, scans_of(options, *stations)};
  if (survey.scans.empty())
    throw config::ConfigError("no scan: give --scan STATION=FILE, or the column scan in " + options.stations);
  return survey;
}

/// A station whose scan is oriented.
struct OrientedScan {
  StationResult result;
  std::string words;             ///< StationScan::words
  std::array<double, 3> origin;  ///< StationScan::origin
};

/// Orients the scan of one station. Errors: those of the file and of orient_station(); Truncated if the file has fewer
/// points than its header counts.
Result<OrientedScan> orient_scan(const std::string& path, const std::optional<storage::ScanFormat>& format,
                                 const Survey& survey, std::size_t station, const TargetsConfig& config) {
  const auto scan = open_station_scan(path, format, survey.stations[station]);
  if (!scan.ok()) return scan.error();
  const storage::ScanFile& file = scan->file;
  const auto result = orient_station(ScanFileBlocks(file), survey.stations, station, survey.targets, config);
  if (!result.ok()) return result.error();
  if (file.layout().points && result->points_read != *file.layout().points)
    return Error{ErrorCode::Truncated, fmt::format("{}: {} points of the {} that its header counts", path,
                                                   result->points_read, *file.layout().points)};
  return OrientedScan{*result, scan->words, scan->origin};
}

/// The stations that were oriented, in the order of the table. The vectors have one entry for each of them.
struct OrientedStations {
  std::vector<StationResult> results;
  std::vector<std::string> files;
  std::vector<std::array<double, 3>> origins;  ///< of the files' coordinates (StationScan::origin)
  int status = kDone;                          ///< exit status for the last station that could not be oriented
};

/// Orients the scan of each station that has one, and prints a line for each. Adds the scans and the refused stations
/// to `notes`.
OrientedStations orient_stations(const CalibrateTargetsOptions& options, const Survey& survey,
                                 const std::optional<storage::ScanFormat>& format, const TargetsConfig& config,
                                 TargetsRunNotes& notes) {
  OrientedStations out;
  for (std::size_t i = 0; i < survey.stations.size(); ++i) {
    const auto found = survey.scans.find(survey.stations[i].name);
    if (found == survey.scans.end()) continue;
    const double reading = options.time_reading ? time_of_reading(found->second) : 0;
    std::optional<Result<OrientedScan>> oriented;
    const double whole = seconds_of([&] { oriented.emplace(orient_scan(found->second, format, survey, i, config)); });
    if (!oriented->ok()) {
      const Error& error = oriented->error();
      log_error(error.message);
      notes.refused.push_back(error.message);
      out.status =
          error.code == ErrorCode::Invalid || error.code == ErrorCode::Exhausted ? kNothingCame : kInputUnreadable;
      continue;
    }
    const StationResult& result = (*oriented)->result;
    fmt::print("{}: {} of {} targets used, {} points in {:.2f} s", survey.stations[i].name,
               std::ranges::count(result.targets, TargetState::Used, &TargetOutcome::state), result.targets.size(),
               result.points_read, whole);
    if (options.time_reading) fmt::print("; reading alone {:.2f} s: {:.2f} times", reading, whole / reading);
    fmt::print("\n");
    if ((*oriented)->origin != std::array<double, 3>{}) fmt::print("{}\n", (*oriented)->words);
    out.results.push_back(result);
    out.files.push_back(found->second);
    out.origins.push_back((*oriented)->origin);
    notes.scans.push_back((*oriented)->words);
  }
  return out;
}

/// Writes targets.json, targets.html and orientation.yaml, and prints their names.
Status write_reports(const fs::path& out, const std::vector<StationResult>& results, const Survey& survey,
                     const TargetsConfig& config, const TargetsRunNotes& notes) {
  const auto& stations = survey.stations;
  const auto& targets = survey.targets;
  Status done = write_output(out / "targets.json", targets_json(results, stations, targets, config, notes));
  if (done.ok()) done = write_output(out / "targets.html", targets_page(results, stations, targets, config, notes));
  if (done.ok()) done = write_output(out / "orientation.yaml", targets_yaml(results, stations, targets, notes));
  fmt::print("{}\n{}\n{}\n", (out / "targets.json").string(), (out / "targets.html").string(),
             (out / "orientation.yaml").string());
  return done;
}

/// Writes the scan `file`, whose coordinates are counted from `scan_origin`, in the survey frame as `path`, and prints
/// how many points it has and how long that took.
Status write_cloud(const std::string& file, const std::optional<storage::ScanFormat>& format,
                   const std::array<double, 3>& scan_origin, const Orientation& orientation,
                   storage::ScanCloudWriter::Format cloud_format, const fs::path& path, const UtcTime& date) {
  const Eigen::Vector3d origin = orientation.T_survey_scanner.translation.array().round();
  Status done;
  const double writing = seconds_of([&] {
    const auto scan = storage::ScanFile::open(file, format, scan_origin);
    const auto cloud = scan.ok() ? write_oriented(*scan, orientation, origin, cloud_format, path, date)
                                 : Result<OrientedCloud>(scan.error());
    if (!cloud.ok()) {
      done = cloud.error();
      return;
    }
    fmt::print("{}: {} points", path.string(), cloud->written);
    if (cloud->without_return > 0) fmt::print(", {} without a return left out", cloud->without_return);
    if (cloud_format == storage::ScanCloudWriter::Format::Float32)
      fmt::print("; float32 x y z from east {:.0f} north {:.0f} up {:.0f}", origin.x(), origin.y(), origin.z());
  });
  if (done.ok()) fmt::print("; {:.2f} s\n", writing);
  return done;
}

int calibrate_targets(const CalibrateTargetsOptions& options) {
  const TargetsConfig config = config_of(options);
  TargetsRunNotes notes;
  notes.date = options.date.empty() ? today() : options.date;
  notes.program = fmt::format("hueline {} ({})", runtime::kVersion, runtime::kGitRevision);
  const UtcTime date = utc_of(notes.date);
  const Survey survey = read_survey(options);
  std::optional<storage::ScanFormat> format;
  if (!options.format.empty()) format = storage::scan_format(options.format);
  OrientedStations oriented = orient_stations(options, survey, format, config, notes);
  std::vector<StationResult>& results = oriented.results;
  if (results.empty()) return oriented.status;
  if (results.size() > 1 && config.method == CentreMethod::KnownRadius)
    if (Status done = adjust_together(results, survey.stations, survey.targets, config); !done.ok())
      throw config::ConfigError(done.error().message);

  const auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) {
    log_error(folder.error().message);
    return kOutputRefused;
  }
  const fs::path out(options.out);
  Status done = write_reports(out, results, survey, config, notes);
  using CloudFormat = storage::ScanCloudWriter::Format;
  const CloudFormat cloud_format = options.write == "las" ? CloudFormat::Las : CloudFormat::Float32;
  for (std::size_t i = 0; i < results.size() && done.ok() && options.write != "none"; ++i) {
    const std::string& name = survey.stations[results[i].station].name;
    done = write_cloud(oriented.files[i], format, oriented.origins[i], results[i].adjusted.orientation, cloud_format,
                       out / (name + (cloud_format == CloudFormat::Las ? ".las" : ".f32")), date);
  }
  if (!done.ok()) {
    log_error(done.error().message);
    return kOutputRefused;
  }
  return oriented.status;
}

}  // namespace

void add_calibrate_targets(Command& calibrate) {
  auto o = std::make_shared<CalibrateTargetsOptions>();
  Command command = calibrate.command(
      "targets", "orient static scans from sphere targets without manual picking (docs/calibration.md)");
  command.required("--targets", o->targets,
                   "CSV of surveyed sphere centres: name,east_m,north_m,up_m[,sigma_m,radius_m,role,stations]");
  command.required("--stations", o->stations, "CSV of stations: name,east_m,north_m,up_m[,sigma_m,scan]");
  command.required("--out", o->out, "folder for targets.json, targets.html, orientation.yaml and the oriented clouds");
  command.option(
      "--scan", o->scans,
      "STATION=FILE with the scan in the scanner's frame or in the stations' coordinates, m: LAS, PLY, PCD, E57, "
      "text or float32 x y z; default: the column scan of the stations");
  command.option(
      "--format", o->format,
      "las, ply, pcd, e57, xyz or float32, if neither the first bytes nor the name of the file show the format");
  command.option("--radius", o->radius_m, "radius of the spheres, m, for targets without radius_m", {0, 1});
  command.setting("--survey-sigma", o->survey_sigma_mm,
                  "sigma of a target's coordinate, mm, for targets without sigma_m", {0.01, 1000});
  command.setting("--range-precision", o->precision_mm, "range noise of the scanner from point to point, mm",
                  {0.1, 100});
  command.setting("--range-accuracy", o->accuracy_mm, "whole range error of the scanner, mm", {0.1, 100});
  command.setting("--angle-sigma", o->angle_urad, "sigma of the scanner's angles, urad", {0, 1000});
  command.setting("--ring", o->ring_radii, "thickness of a ring in radii of the largest sphere", {2, 6});
  command.setting("--station-doubt", o->station_doubt_m,
                  "largest error of a station's place, m, for stations without sigma_m", {0, 5});
  command.setting("--most-tilt", o->most_tilt_deg, "largest tilt of the scanner's z axis, degrees", {0.1, 180});
  command.setting("--method", o->method, "known-radius, or the published method for comparison",
                  {"known-radius", "published"});
  command.setting("--write", o->write, "also write the oriented clouds", {"none", "las", "float32"});
  command.setting("--threads", o->threads, "number of threads; the result does not depend on it", {1, 256});
  command.option("--date", o->date, "date of the calibration, YYYY-MM-DD; default: today");
  command.flag("--scale", o->scale, "estimate the scale as well");
  command.flag("--time-reading", o->time_reading, "print how long reading each file alone takes");
  command.footer(
      "Example: hueline calibrate targets --targets targets.csv --stations stations.csv --out oriented\n"
      "Exit status: 0; 3 if an input cannot be read; 5 if a scan cannot be oriented.\n"
      "More: docs/calibration.md");
  command.reads(o->targets).reads(o->stations).writes_into(o->out);
  command.runs([o] { return calibrate_targets(*o); });
}

}  // namespace hueline::apps
