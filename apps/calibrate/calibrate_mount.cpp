#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "apps/calibrate/calibrate.hpp"
#include "apps/calibrate/calibrate_drive.hpp"
#include "apps/calibrate/calibrate_shot.hpp"
#include "apps/colour/shot_calibration.hpp"
#include "apps/exit_code.hpp"
#include "apps/input_error.hpp"
#include "apps/log.hpp"
#include "calibration/mount/correspondence_file.hpp"
#include "calibration/mount/mount_report.hpp"
#include "config/key_reader.hpp"
#include "config/rig.hpp"
#include "core/angle.hpp"
#include "core/output_file.hpp"
#include "runtime/lens_values.hpp"

namespace hueline::apps {
namespace {

using namespace calibration;

constexpr double kUsualUnitSigma = 2;  // more than this is no accident with ten points

struct CalibrateMountOptions {
  DriveOptions drive;
  std::string points, lens_file, scanner, out, date;
  std::string image, cloud, start, image_size = "refuse", image_turn = "auto";
  int every = 4, starts = 1;
  double search_time_ms = 50, off_deg = 0, off_ms = 0;
  double sigma_px = 1, sigma_point_m = 0.01, search_deg = 3, far_deg = 30, far_m = 0.5;
};

/// A lens before its resection.
struct KnownLens {
  std::string name;
  fusion::CameraIntrinsics intrinsics;
  std::optional<Transform<Scanner, Lens>> nominal;  ///< nominal pose from the rig
};

/// The scanner, the head and the lenses of a rig.
struct KnownRig {
  std::vector<KnownLens> lenses;
  std::optional<Transform<Body, Scanner>> T_body_scanner;
  std::optional<Transform<Body, CameraHead>> T_body_head;
};

KnownRig known_of(const CalibrateMountOptions& options) {
  KnownRig out;
  if (!options.lens_file.empty()) {
    out.lenses.push_back({"", read_lens(options.lens_file), {}});
    return out;
  }
  const config::Rig rig = config::load_rig(options.drive.rig);
  const fusion::LaserMount* laser = nullptr;
  for (const auto& one : rig.geometry.lasers)
    if (options.scanner.empty() || rig.sensor_names()[one.sensor] == options.scanner) {
      laser = &one;
      break;
    }
  if (!laser) throw config::ConfigError(fmt::format("{}: has no scanner {}", options.drive.rig, options.scanner));
  out.T_body_scanner = laser->T_body_scanner;
  out.T_body_head = rig.geometry.head.T_body_head;
  for (const auto& lens : rig.geometry.head.lenses)
    out.lenses.push_back({lens.name, lens.intrinsics,
                          laser->T_body_scanner.inverse() * rig.geometry.head.T_body_head * lens.T_head_lens});
  return out;
}

/// Returns an empty text if the pose can be that of the rig's lens, and what is wrong otherwise. A resection rotates
/// with its points. Axes that were exchanged in pairs are therefore noticed only here.
std::string far_from_nominal(const Transform<Scanner, Lens>& found, const Transform<Scanner, Lens>& nominal,
                             const CalibrateMountOptions& options) {
  const double turn = found.rotation.angularDistance(nominal.rotation) * kDegPerRad,
               shift = (found.translation - nominal.translation).norm();
  if (turn > options.far_deg)
    return fmt::format(
        "the lens would be rotated by {:.0f} deg from its pose in the rig: the points' axes are not the scanner's (x "
        "right, y forward, z up)",
        turn);
  // The unit of the points changes the centre but not the rays. The centre shows a wrong unit as long as its nominal
  // place is well known.
  constexpr double kPerMetre[] = {3.28084, 39.3701, 100, 1000};  // feet, inches, centimetres, millimetres
  constexpr const char* kUnit[] = {"feet", "inches", "centimetres", "millimetres"};
  for (std::size_t i = 0; i < std::size(kPerMetre); ++i)
    for (const double scale : {kPerMetre[i], 1 / kPerMetre[i]}) {
      const double left = (found.translation / scale - nominal.translation).norm();
      if (shift < 0.1 || left > 0.2 * shift) continue;
      return fmt::format(
          "the lens would be {:.2f} m from its place in the rig, but {:.2f} m with points {} far away: wrong units, {} "
          "{} metres",
          shift, left, scale > 1 ? fmt::format("1/{:.4g} as", scale) : fmt::format("{:.4g} times as", 1 / scale),
          kUnit[i], scale > 1 ? "taken for" : "converted twice to");
    }
  if (shift > options.far_m)
    return fmt::format("the lens would be {:.2f} m from its place in the rig: wrong units, or points of another place",
                       shift);
  return {};
}

/// Returns the lens of the points. Null, with a logged error, if there is none.
const KnownLens* lens_of(const LensCorrespondences& seen, const KnownRig& known, const CalibrateMountOptions& options) {
  const auto lens = std::find_if(known.lenses.begin(), known.lenses.end(), [&](const KnownLens& one) {
    return one.name == seen.lens || (seen.lens.empty() && known.lenses.size() == 1);
  });
  if (lens != known.lenses.end()) return &*lens;
  if (options.drive.rig.empty()) {
    log_error(
        "{}: without a rig all points must be of one lens; leave the column lens out, or give --rig: there are some of "
        "lens '{}'",
        options.points, seen.lens);
    return nullptr;
  }
  std::string names;
  for (const KnownLens& one : known.lenses) names += (names.empty() ? "" : ", ") + one.name;
  const std::string what = seen.lens.empty() ? "the rig has several lenses, so the points need the column lens"
                                             : fmt::format("the rig has no lens '{}'", seen.lens);
  log_error("{}: {}; its lenses are: {}", options.points, what, names);
  return nullptr;
}

/// Returns the pose of the lens from its points. Nothing, with a logged error, if the points do not give one that can
/// be right.
std::optional<Resection> resect_lens(const LensCorrespondences& seen, const KnownLens& lens,
                                     const CalibrateMountOptions& options) {
  const auto found = resect(runtime::lens_values(lens.intrinsics), seen.points,
                            {.sigma_px = options.sigma_px, .sigma_point_m = options.sigma_point_m});
  const std::string wrong = !found.ok()    ? found.error().message
                            : lens.nominal ? far_from_nominal(found->T_scanner_lens, *lens.nominal, options)
                                           : "";
  if (wrong.empty()) return *found;
  log_error("lens '{}': {}", seen.lens, wrong);
  return std::nullopt;
}

/// Prints the pose, its standard deviations (those of `record`) and the points that were left out.
void print_resection(const LensCorrespondences& seen, const Resection& found, const CalibrationRecord& record) {
  std::string said = fmt::format("lens '{}': {} of {} points, rms {:.3f} px, sigma of unit weight {:.2f}\n", seen.lens,
                                 found.used, seen.points.size(), found.rms_px, found.unit_sigma);
  said += fmt::format(
      "  centre in the scanner's frame {:.4f} {:.4f} {:.4f} m +- {:.1f} {:.1f} {:.1f} mm, turn +- {:.4f} {:.4f} "
      "{:.4f} deg\n",
      found.T_scanner_lens.translation.x(), found.T_scanner_lens.translation.y(), found.T_scanner_lens.translation.z(),
      record.sigma[3] * 1e3, record.sigma[4] * 1e3, record.sigma[5] * 1e3, record.sigma[0], record.sigma[1],
      record.sigma[2]);
  for (std::size_t i = 0; i < seen.points.size(); ++i)
    if (!found.is_used[i])
      said += fmt::format("  left out: point {}, {:.1f} px off\n", seen.points[i].name, found.residuals[i].norm());
  std::fputs(said.c_str(), stdout);
}

/// Returns the pose for a rig file: T_head_lens if the scanner and the head are known, otherwise T_lens_scanner.
/// `record` is that of the rotation in the scanner's frame.
std::string rig_fragment(const KnownRig& known, const Resection& found, const CalibrationRecord& record) {
  if (!known.T_body_scanner) {
    const auto back = found.T_scanner_lens.inverse();
    return mounting_yaml("T_lens_scanner", back.rotation, back.translation, record, 0);
  }
  // The chain of docs/methods equations 15 and 16. The rig has the transformation from scanner to body; `capture`
  // reads the pose of the lens in its head.
  const Transform<CameraHead, Scanner> T_head_scanner = known.T_body_head->inverse() * *known.T_body_scanner;
  const Transform<CameraHead, Lens> T_head_lens = T_head_scanner * found.T_scanner_lens;
  const auto in_head = mount_record(found.covariance, T_head_scanner.rotation.toRotationMatrix(), record.date,
                                    record.data, found.rms_px);
  return mounting_yaml("T_head_lens", T_head_lens.rotation, T_head_lens.translation, in_head, 0);
}

/// Writes the fragment and the report of one lens into the folder `out`.
Status write_resection(const std::string& out, const LensCorrespondences& seen, const Resection& found,
                       const std::string& fragment) {
  const auto folder = OutputFolder::open(out);
  if (!folder.ok()) return folder.error();
  const std::filesystem::path stem = std::filesystem::path(out) / (seen.lens.empty() ? "lens" : seen.lens);
  Status done = write_output(stem.string() + ".yaml", fragment);
  if (done.ok()) done = write_output(stem.string() + ".json", resection_json(seen.lens, seen.points, found));
  return done;
}

int resect_lenses(const CalibrateMountOptions& options, const std::string& date) {
  const auto read = parse_correspondences(read_table(options.points), options.points);
  if (!read.ok()) {
    log_error(read.error().message);
    return kInputUnreadable;
  }
  const KnownRig known = known_of(options);
  int status = kDone;
  for (const LensCorrespondences& seen : *read) {
    const KnownLens* lens = lens_of(seen, known, options);
    const auto found = lens ? resect_lens(seen, *lens, options) : std::nullopt;
    if (!found) {
      status = kInputUnreadable;
      continue;
    }
    const std::vector<std::string> data = {fmt::format("{} of {} points of {}", found->used, seen.points.size(),
                                                       std::filesystem::path(options.points).filename().string())};
    const auto record = mount_record(found->covariance, Eigen::Matrix3d::Identity(), date, data, found->rms_px);
    print_resection(seen, *found, record);
    if (found->unit_sigma > kUsualUnitSigma)
      log_warning(
          "the points differ from the best pose {:.1f} times as much as --sigma-px and --sigma-point-m allow: check "
          "that "
          "they are the same points in image and scan, of one moment, and that the lens is that of the image",
          found->unit_sigma);
    if (options.out.empty()) continue;
    const Status written = write_resection(options.out, seen, *found, rig_fragment(known, *found, record));
    if (!written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
  }
  return status;
}

/// Runs the way of calibrating that the options ask for. Throws config::ConfigError if one of its options is missing.
int calibrate_mount(const CalibrateMountOptions& options) {
  const std::string date = options.date.empty() ? today() : options.date;
  if (!options.image.empty() || !options.cloud.empty()) {
    if (options.image.empty() || options.cloud.empty() || options.start.empty() || options.lens_file.empty())
      throw config::ConfigError("without targets: give --image, --cloud, --lens and --start");
    return calibrate_shot({options.image, options.cloud, options.lens_file, options.start, options.out, date,
                           options.image_size, options.image_turn, options.search_deg, options.off_deg,
                           options.starts});
  }
  if (!options.drive.recording.empty() || !options.drive.scenario.empty()) {
    options.drive.check();
    return calibrate_drive({options.drive, options.out, date, options.search_deg, options.search_time_ms,
                            options.off_deg, options.off_ms, options.starts, options.every});
  }
  if (options.points.empty()) throw config::ConfigError("give --points, --image and --cloud, or --recording");
  if (options.drive.rig.empty() == options.lens_file.empty()) throw config::ConfigError("give one of --rig and --lens");
  return resect_lenses(options, date);
}

}  // namespace

void add_calibrate_mount(Command& calibrate) {
  auto options = std::make_shared<CalibrateMountOptions>();
  Command command = calibrate.command("mount",
                                      "find the mounting of a lens from points measured in image and scan, or of a "
                                      "lens or head by aligning images with laser points");
  command.option("--points", options->points,
                 "CSV with u_px, v_px, x_m, y_m, z_m (in the scanner's frame), optionally name and lens");
  command.option("--lens", options->lens_file,
                 "without --rig: lens.yaml of calibrate lens, or another file of a lens that hueline colour reads; the "
                 "result is T_lens_scanner, for hueline colour");
  command.option("--scanner", options->scanner, "name of the scanner in the rig; default: the first one");
  command.setting("--sigma-px", options->sigma_px, "standard deviation of an image coordinate",
                  {.least = 0.01, .most = 99});
  command.setting("--sigma-point-m", options->sigma_point_m, "standard deviation of a scanner coordinate",
                  {.least = 0, .most = 9});
  command.setting("--far-deg", options->far_deg,
                  "a result rotated farther than this from the rig's mounting is refused", {.least = 0.1, .most = 360});
  command.setting("--far-m", options->far_m, "a result farther than this from the rig's place is refused",
                  {.least = 0.001, .most = 1000});
  command.option("--image", options->image, "without targets: an image; needs --cloud, --lens and --start");
  command.option(
      "--cloud", options->cloud,
      "with --image: the laser's cloud of the same moment (PCD, PLY, LAS, .bin or .npy, with x, y, z, intensity)");
  command.option("--start", options->start,
                 "with --image: pose of the laser, wrong by at most --search-deg: YAML with T_lens_scanner:, or "
                 "another file that hueline colour reads");
  command.setting("--image-size", options->image_size, std::string("without targets: ") + kImageSizeHelp,
                  kImageSizeWords);
  command.setting("--image-turn", options->image_turn, std::string("without targets, ") + kImageTurnHelp,
                  kImageTurnWords);
  command.setting("--search-deg", options->search_deg, "largest error of the start, about each axis",
                  {.least = 0.1, .most = 15});
  options->drive.declare(
      command,
      {.recording = "--recording",
       .recording_help =
           "without targets: drive.mcap of a drive; the result is T_body_head and the time offset of the images",
       .rig_help = "rig file with lenses, scanner and head; with --points the result is T_head_lens of each lens"});
  command.setting(
      "--off-deg", options->off_deg,
      "with --scenario or --image: rotation error that is added to the start, to see whether the result is the same; "
      "with --image nothing is written",
      {.least = 0, .most = 15});
  command.setting("--off-ms", options->off_ms, "with --scenario: error that is added to the times of the images",
                  {.least = -500, .most = 500});
  command.setting("--starts", options->starts, "number of directions of --off-deg, one calibration each",
                  {.least = 1, .most = 100});
  command.setting("--search-time-ms", options->search_time_ms,
                  "largest time offset of the images; 0: their times are correct", {.least = 0, .most = 1000});
  command.setting("--every", options->every, "of a drive, use only every n-th exposure", {.least = 1, .most = 1000});
  command.option("--date", options->date, "date of the result, YYYY-MM-DD; default: today");
  command.option("--out", options->out, "folder for a rig fragment and, with --points, a JSON report for each lens");
  command.reads(options->points)
      .reads(options->lens_file)
      .reads(options->image)
      .reads(options->cloud)
      .reads(options->start);
  command.writes_into(options->out);
  // One way of the three.
  command.excludes("--points", "--image").excludes("--points", "--recording").excludes("--points", "--scenario");
  command.excludes("--image", "--recording").excludes("--image", "--scenario");
  command.footer(
      "Example: hueline calibrate mount --rig rig.yaml --recording drives/today --out mount\n"
      "Exit status: 0; 3 if an input cannot be read; 5 if the mounting cannot be determined.\n"
      "More: docs/calibration.md");
  command.runs([options] { return calibrate_mount(*options); });
}

}  // namespace hueline::apps
