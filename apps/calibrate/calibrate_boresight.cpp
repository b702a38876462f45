#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "apps/calibrate/calibrate.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/progress_bar.hpp"
#include "apps/simulate/drive_source.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "calibration/boresight/boresight_report.hpp"
#include "calibration/mount/mount_report.hpp"
#include "config/section.hpp"
#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "survey/drive_returns.hpp"

namespace hueline::apps {
namespace {

using namespace calibration;

struct CalibrateBoresightOptions {
  DriveOptions drive;
  std::string out, date;
  double off_deg = 0, off_m = 0, lever_sigma_m = 0.02, correlation_s = 90, near_m = 2, far_m = 35;
  int starts = 1;
};

/// Rotates every scanner by off_deg and moves it by off_m, in direction `number` of options.starts. The directions are
/// spread evenly over the sphere (Fibonacci lattice).
config::Rig put_off(config::Rig rig, const CalibrateBoresightOptions& options, int number) {
  const double z = 1 - (2 * number + 1.0) / options.starts, around = 0.7 + number * 2.399963229728653,
               flat = std::sqrt(1 - z * z);
  const Eigen::Vector3d axis(flat * std::cos(around), flat * std::sin(around), z), aside(axis.z(), axis.x(), axis.y());
  for (auto& laser : rig.geometry.lasers) {
    laser.T_body_scanner.rotation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(options.off_deg / kDegPerRad, axis)) * laser.T_body_scanner.rotation)
            .normalized();
    laser.T_body_scanner.translation += options.off_m * aside;
  }
  return rig;
}

/// Reads the drive once. `fed` receives the status at its end.
BoresightDrive gather(DriveSource& source, const config::Rig& rig, const CalibrateBoresightOptions& options,
                      ProgressBar& bar, Status& fed, survey::DriveReturns::Counts& counts) {
  ReturnStore::Config wanted;
  wanted.near_m = options.near_m;
  wanted.far_m = options.far_m;
  if (const std::string wrong = wanted.validate(); !wrong.empty()) throw config::ConfigError(wrong);
  survey::DriveReturns returns(rig, wanted);
  fed = source.feed_without_colours(bar, rig, returns);
  bar.end();
  BoresightDrive drive = returns.take();
  counts = returns.counts();
  return drive;
}

std::string against_truth(const Boresight& found, const DriveSource& source) {
  const config::Rig truth = config::parse_rig(simulated_rig(*source.scenario, {}, "lens"), "simulated rig");
  std::string said;
  for (std::size_t s = 0; s < found.scanners.size() && s < truth.geometry.lasers.size(); ++s) {
    const auto& T = found.scanners[s].T_body_scanner;
    const auto& T_true = truth.geometry.lasers[s].T_body_scanner;
    const Eigen::AngleAxisd off(T.rotation * T_true.rotation.conjugate());
    const Eigen::Vector3d turn = off.axis() * std::remainder(off.angle(), 2 * 3.14159265358979323846),
                          lever = T.translation - T_true.translation;
    said += fmt::format(
        "against the simulator's truth: {:.4f} deg ({:.4f} {:.4f} {:.4f}), lever arm {:.1f} mm in plane ({:.1f} {:.1f} "
        "{:.1f}); over sigma",
        turn.norm() * kDegPerRad, turn.x() * kDegPerRad, turn.y() * kDegPerRad, turn.z() * kDegPerRad,
        lever.head<2>().norm() * 1e3, lever.x() * 1e3, lever.y() * 1e3, lever.z() * 1e3);
    for (std::size_t i = 0; i < 6; ++i) {
      const auto at = static_cast<Eigen::Index>(i % 3);
      said += fmt::format(" {:.2f}", std::abs(i < 3 ? turn[at] : lever[at]) / found.scanners[s].sigma[i]);
    }
    said += "\n";
  }
  return said;
}

/// Warns of a lever arm that moved farther than its measurement allows: either the measurement or the result is wrong.
void warn_of_lever_arms(const Boresight& found, double sigma_m) {
  for (const ScannerBoresight& one : found.scanners)
    if (const double most = one.lever_moved_m.cwiseAbs().maxCoeff(); most > 3 * sigma_m)
      log_warning(
          "{}: the planes move the lever arm by {:.3f} m, more than three times its --lever-sigma-m of {} m: measure "
          "it again, or give a larger --lever-sigma-m",
          one.name, most, sigma_m);
}

Status write_results(const CalibrateBoresightOptions& options, const Boresight& found, const std::string& date) {
  const auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) return folder.error();
  const std::string data = options.drive.recording.empty() ? options.drive.scenario : options.drive.recording;
  std::vector<std::pair<std::string, std::string>> files{{"boresight.json", boresight_json(found)}};
  for (std::size_t s = 0; s < found.scanners.size(); ++s) {
    const auto& T = found.scanners[s].T_body_scanner;
    const std::string name =
        found.scanners.size() == 1 ? "T_body_scanner.yaml" : "T_body_scanner_" + found.scanners[s].name + ".yaml";
    files.emplace_back(
        name, mounting_yaml("T_body_scanner", T.rotation, T.translation, boresight_record(found, s, date, {data}), 0));
  }
  for (const auto& [name, text] : files) {
    const auto path = std::filesystem::path(options.out) / name;
    if (Status written = write_output(path, text); !written.ok()) return written;
    std::fputs((path.string() + "\n").c_str(), stdout);
  }
  return {};
}

int calibrate(const CalibrateBoresightOptions& options) {
  options.drive.check();
  if (options.drive.scenario.empty() && (options.off_deg > 0 || options.off_m > 0 || options.starts > 1))
    throw config::ConfigError("--off-deg, --off-m and --starts are for a --scenario, whose truth is known");
  ProgressBar bar;
  auto source = DriveSource::open(options.drive, bar);
  bar.end();
  if (!source.ok()) {
    log_error(source.error().message);
    return opening_status(source.error());
  }
  if (source->rig.geometry.lasers.empty())
    throw config::ConfigError("the rig has no laser scanner: there is nothing to calibrate");
  BoresightConfig config;
  config.sigma_lever_m = options.lever_sigma_m;
  config.correlation_s = options.correlation_s;
  config.progress = [&](const std::string& stage, double share) { bar.show(stage, share); };
  const std::string date = options.date.empty() ? today() : options.date;
  int status = kDone;
  for (int number = 0; number < options.starts; ++number) {
    Status fed;
    survey::DriveReturns::Counts counts;
    const BoresightDrive drive = gather(*source, put_off(source->rig, options, number), options, bar, fed, counts);
    if (!fed.ok()) {
      log_warning(fed.error().message);
      status = kInputUnreadable;
    }
    if (counts.no_pose > 0 || counts.badly_timed > 0)
      log_info("{} returns placed; {} without a pose, {} without a good time", counts.placed, counts.no_pose,
               counts.badly_timed);
    if (drive.returns.empty()) {
      log_error("no laser return could be placed: {} POS solutions, {} returns without a pose, {} without a good time",
                counts.solutions, counts.no_pose, counts.badly_timed);
      return kNothingCame;
    }
    const auto found = find_boresight(drive, config);
    bar.end();
    if (!found.ok()) {
      log_error(found.error().message);
      return kInputUnreadable;
    }
    std::fputs(boresight_text(*found).c_str(), stdout);
    if (source->scenario) std::fputs(against_truth(*found, *source).c_str(), stdout);
    std::fflush(stdout);
    warn_of_lever_arms(*found, options.lever_sigma_m);
    if (options.out.empty() || number > 0) continue;
    if (const Status written = write_results(options, *found, date); !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
  }
  return status;
}

}  // namespace

void add_calibrate_boresight(Command& calibrate_command) {
  auto options = std::make_shared<CalibrateBoresightOptions>();
  Command command = calibrate_command.command(
      "boresight", "find the mounting of a scanner from planes that a drive passes at least twice");
  options->drive.declare(
      command, {.recording = "--recording",
                .recording_help = "drive.mcap of a drive along the same street in both directions",
                .rig_help = "rig with the measured T_body_scanner as the start; default: the rig of the recording"});
  command.setting("--lever-sigma-m", options->lever_sigma_m, "standard deviation of the measured lever arm, each axis",
                  {.least = 0.0001, .most = 1});
  command.setting("--correlation-s", options->correlation_s, "correlation time of the POS's slow errors",
                  {.least = 1, .most = 100000});
  command.setting("--near-m", options->near_m, "nearer returns are left out, because they are of the vehicle itself",
                  {.least = 0, .most = 20});
  command.setting("--far-m", options->far_m, "farther returns are left out", {.least = 5, .most = 200});
  command.setting("--off-deg", options->off_deg, "with --scenario: rotation error of the start against the truth",
                  {.least = 0, .most = 15});
  command.setting("--off-m", options->off_m, "with --scenario: lever-arm error of the start against the truth",
                  {.least = 0, .most = 1});
  command.setting("--starts", options->starts,
                  "with --scenario: number of directions of --off-deg and --off-m, one calibration each",
                  {.least = 1, .most = 100});
  command.option("--date", options->date, "date of the result, YYYY-MM-DD; default: today");
  command.option("--out", options->out,
                 "folder for boresight.json and T_body_scanner.yaml, which replaces the same key of the rig");
  command.footer(
      "Drive slowly along a street with buildings, a minute in each direction, with a U-turn. A value that the\n"
      "drive does not determine (most often the lever arm's height) stays as measured, and the output says so.\n"
      "Example: hueline calibrate boresight --recording drives/today --out boresight\n"
      "Exit status: 0; 3 if the recording could be read only in part, or does not determine the mounting; 5 if no "
      "return could be placed.\n"
      "More: docs/calibration.md");
  command.writes_into(options->out);
  command.runs([options] { return calibrate(*options); });
}

}  // namespace hueline::apps
