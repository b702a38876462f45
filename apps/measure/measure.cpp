#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/input_error.hpp"
#include "apps/log.hpp"
#include "apps/simulate/drive_source.hpp"
#include "apps/simulate/drive_trajectory.hpp"
#include "config/section.hpp"
#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/geodesy.hpp"
#include "core/output_file.hpp"
#include "storage/las_writer.hpp"
#include "storage/projection.hpp"
#include "survey/object_measuring.hpp"
#include "survey/panorama_table.hpp"

namespace hueline::apps {
namespace {

struct MeasureOptions {
  DriveOptions drive;
  TrajectoryOptions trajectory;
  std::string picks, panoramas, out;
  double around_s = 2, sigma_px = 0.5, sigma_turn_deg = 0.02;
};

std::string table(const std::vector<survey::PickOutcome>& outcomes, const Geodetic& origin,
                  storage::Projection& projection) {
  const storage::MapOperation& map = projection.operation();
  std::string out = fmt::format(
      "# east_m, north_m, up_m: local level at latitude {0:.3f}, longitude {1:.3f} deg, height {2:.0f} m; "
      "easting_{6}, northing_{6}, height_{7}: {3} ({4}), positions of {5}\n"
      "name,exposure,lens,u_px,v_px,exposed_gps_s,east_m,north_m,up_m,sigma_east_m,sigma_north_m,sigma_up_m,"
      "easting_{6},northing_{6},height_{7},latitude_deg,longitude_deg,"
      "distance_m,oblique_deg,scatter_m,points,seconds,why_not\n",
      origin.latitude / kRadPerDeg, origin.longitude / kRadPerDeg, origin.ellipsoidal_height, map.name(), map.crs(),
      map.words(), map.unit().name, map.up_unit().name);
  const auto T_ecef_enu = ecef_from_enu(origin);
  for (const survey::PickOutcome& one : outcomes) {
    out += fmt::format(
        "{},{},{},{:.3f},{:.3f},{},", csv_value(one.pick.name), one.pick.exposure, one.lens, one.lens_pixel.x(),
        one.lens_pixel.y(),
        one.exposed ? fmt::format("{:.6f}", static_cast<double>(count_ns(*one.exposed) / 1000) * 1e-6) : "");
    if (!one.object.ok()) {
      std::string why = one.object.error().message;
      for (char& c : why)
        if (c == ',') c = ';';
      out += ",,,,,,,,,,,,,,,," + why + "\n";
      continue;
    }
    const fusion::MeasuredObject& object = *one.object;
    const Eigen::Vector3d p = object.p_enu, at = projection.project(p.x(), p.y(), p.z());
    const Geodetic place = to_geodetic(T_ecef_enu * Point<Enu>{p});
    out += fmt::format(
        "{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.10f},{:.10f},{:.3f},{:.1f},{:.4f},{},{:.2f},"
        "\n",
        p.x(), p.y(), p.z(), std::sqrt(object.covariance(0, 0)), std::sqrt(object.covariance(1, 1)),
        std::sqrt(object.covariance(2, 2)), at.x(), at.y(), at.z(), place.latitude / kRadPerDeg,
        place.longitude / kRadPerDeg, object.distance_m, object.oblique_deg, object.scatter_m, object.points,
        object.seconds);
  }
  return out;
}

int measure(const MeasureOptions& options) {
  options.drive.check();
  const auto picks = survey::parse_object_picks(read_table(options.picks), options.picks);
  if (!picks.ok()) {
    log_error(picks.error().message);
    return kInputUnreadable;
  }
  std::map<std::uint32_t, survey::ListedPanorama> panoramas;
  if (!options.panoramas.empty()) {
    auto listed = survey::parse_panorama_table(read_table(options.panoramas), options.panoramas);
    if (!listed.ok()) {
      log_error(listed.error().message);
      return kInputUnreadable;
    }
    panoramas = std::move(*listed);
  }
  ProgressBar bar;
  auto source = DriveSource::open(options.drive, bar);
  bar.end();
  if (!source.ok()) {
    log_error(source.error().message);
    return opening_status(source.error());
  }
  if (source->rig.geometry.head.lenses.empty())
    throw config::ConfigError("the rig has no camera head: there is no image to pick in");
  survey::ObjectMeasuring::Config config;
  config.around = nanoseconds(std::llround(options.around_s * 1e9));
  config.pick_sigma_px = options.sigma_px;
  config.turn_sigma_deg = options.sigma_turn_deg;
  if (const std::string wrong = config.validate(); !wrong.empty()) throw config::ConfigError(wrong);
  const auto trajectory = open_trajectory(options.trajectory, options.drive, bar);
  bar.end();
  if (!trajectory.ok()) {
    log_error(trajectory.error().message);
    return opening_status(trajectory.error());
  }
  survey::ObjectMeasuring measuring(source->rig, *picks, config, panoramas);
  Status fed = source->feed_without_colours(bar, source->rig, measuring, trajectory->get());
  bar.end();
  if (*trajectory && fed.ok()) fed = (*trajectory)->status();
  if (!fed.ok()) log_warning(fed.error().message);
  const auto outcomes = measuring.finish();
  if (!measuring.origin()) {
    log_error("no point of the drive could be placed");
    return kNothingCame;
  }
  // The date counts where the datums move against each other.
  const auto dated = std::ranges::find_if(outcomes, [](const auto& one) { return one.exposed.has_value(); });
  const double epoch = dated == outcomes.end() ? 0 : storage::decimal_year(to_utc(*dated->exposed));
  auto projection = storage::Projection::create(*measuring.origin(), source->rig.map, epoch);
  if (!projection.ok()) throw config::ConfigError(projection.error().message);
  const std::string result = table(outcomes, *measuring.origin(), *projection);
  if (options.out.empty()) {
    std::fputs(result.c_str(), stdout);
  } else if (const Status written = write_output(options.out, result); !written.ok()) {
    log_error(written.error().message);
    return kOutputRefused;
  }
  std::size_t measured = 0;
  for (const auto& one : outcomes) measured += one.object.ok();
  if (!options.out.empty())
    std::fputs(fmt::format("{} of {} objects measured: {}\n", measured, outcomes.size(), options.out).c_str(), stdout);
  return measured ? (fed.ok() ? kDone : kInputUnreadable) : kNothingCame;
}

}  // namespace

void add_measure(Command& all) {
  auto options = std::make_shared<MeasureOptions>();
  Command command = all.command(kMeasure.word, kMeasure.help);
  options->drive.declare(command, {.recording = "RECORDING",
                                   .recording_help = "drive.mcap",
                                   .rig_help = "calibrated rig; default: the rig of the recording"});
  options->trajectory.declare(command);
  command.required("--picks", options->picks,
                   "CSV with exposure (as in cloud.las), u_px, v_px, optionally name and lens; without lens the pixel "
                   "is in the panorama");
  command.option("--panoramas", options->panoramas,
                 "panoramas.csv of hueline panorama: picks without a lens are pixels of its pictures");
  command.setting("--around-s", options->around_s,
                  "laser points within this time before and after the exposure are used", {.least = 0.01, .most = 600});
  command.setting("--sigma-px", options->sigma_px, "standard deviation of a picked coordinate",
                  {.least = 0.001, .most = 100});
  command.setting("--sigma-turn-deg", options->sigma_turn_deg,
                  "standard deviation of the lens's rotation relative to the scanner, from its calibration record",
                  {.least = 0, .most = 10});
  command.option("--out", options->out, "CSV file to write; default: print it");
  command.reads(options->picks).reads(options->panoramas).writes(options->out);
  command.footer(
      "Example: hueline measure drives/today --picks picks.csv --out objects.csv\n"
      "Exit status: 0; 3 if an input cannot be read, or only in part; 5 if nothing could be measured.\n"
      "More: docs/calibration.md");
  command.runs([options] { return measure(*options); });
}

}  // namespace hueline::apps
