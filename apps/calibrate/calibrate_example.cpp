#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "apps/calibrate/calibrate.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "core/output_file.hpp"
#include "sim/static_scan/static_scanner.hpp"

namespace hueline::apps {
namespace {

namespace fs = std::filesystem;

struct CalibrateExampleOptions {
  std::string out;
  int stations = 1, seed = 1, threads = 2;
  double points = 3e6, accuracy_mm = 8;
};

int example(const CalibrateExampleOptions& options) {
  const auto folder = OutputFolder::open(options.out);
  if (!folder.ok()) {
    log_error(folder.error().message);
    return kOutputRefused;
  }
  std::string stations = "name,east_m,north_m,up_m,scan\n",
              targets = "name,east_m,north_m,up_m,sigma_m,radius_m,role,stations\n",
              truth = "station,name,kind,true_east_m,true_north_m,true_up_m,hits\n";
  for (int i = 0; i < options.stations; ++i) {
    sim::StaticSiteConfig config;
    config.seed = static_cast<std::uint64_t>(options.seed);
    config.station = i;
    config.radius_m = i % 2 ? 0.145 : 0.0725;
    config.common_range_sigma_m = std::sqrt(std::max(0.0, options.accuracy_mm * options.accuracy_mm - 25)) / 1000;
    const sim::StaticSite site = sim::make_static_site(config);
    sim::StaticScannerConfig scanner;
    const auto wanted = static_cast<std::uint64_t>(options.points);
    // A slightly finer step and a cut at the end give the exact number of points. Windows are used only where the
    // panorama is coarser than they are.
    scanner.step_deg = 0.995 * sim::step_for_points(site, scanner, wanted);
    if (scanner.step_deg <= scanner.window_step_deg) scanner.window_step_deg = 0;
    const sim::StaticScan scan(site, scanner);
    const std::string file = site.name + ".f32";
    std::vector<sim::SphereTruth> hits(site.spheres.size());
    const std::uint64_t most = scanner.window_step_deg > 0 ? ~0ull : wanted;
    const auto written = sim::write_static_scan(scan, (fs::path(options.out) / file).string(), most,
                                                static_cast<unsigned>(options.threads), hits);
    if (!written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
    const auto& s = site.surveyed_place;
    stations += fmt::format("{},{:.4f},{:.4f},{:.4f},{}\n", site.name, s.x, s.y, s.z, file);
    for (std::size_t k = 0; k < site.spheres.size(); ++k) {
      const sim::StaticSphere& sphere = site.spheres[k];
      const sim::Vec3 at = site.place_survey + sphere.centre, p = site.surveyed[k];
      const bool is_decoy = sphere.kind == sim::SphereKind::Decoy, is_check = sphere.kind == sim::SphereKind::Check;
      truth += fmt::format("{},{},{},{:.5f},{:.5f},{:.5f},{}\n", site.name, sphere.name,
                           is_decoy   ? "decoy"
                           : is_check ? "check"
                                      : "orientation",
                           at.x, at.y, at.z, hits[k].hits);
      if (!is_decoy)
        targets += fmt::format("{},{:.4f},{:.4f},{:.4f},{},{},{},{}\n", sphere.name, p.x, p.y, p.z,
                               config.survey_sigma_m, sphere.radius, is_check ? "check" : "orientation", site.name);
    }
    fmt::print("{}: {} points, step {:.4f} deg\n", file, *written, scanner.step_deg);
  }
  for (const auto& [name, text] : {std::pair{"stations.csv", stations}, {"targets.csv", targets}, {"truth.csv", truth}})
    if (Status done = write_output(fs::path(options.out) / name, text); !done.ok()) {
      log_error(done.error().message);
      return kOutputRefused;
    }
  return kDone;
}

}  // namespace

void add_calibrate_example(Command& calibrate) {
  auto o = std::make_shared<CalibrateExampleOptions>();
  Command command = calibrate.command("targets-example",
                                      "simulate static scans with sphere targets, decoys, trees and walls, as input of "
                                      "calibrate targets, with the truth");
  command.required("--out", o->out,
                   "folder for stations.csv, targets.csv, truth.csv and one float32 scan for each station");
  command.setting("--stations", o->stations, "number of stations", {1, 1000});
  command.setting(
      "--points", o->points,
      "points of each panorama; below 107 million the surroundings of the targets are scanned again with a finer step",
      {1e4, 2e9});
  command.setting("--accuracy", o->accuracy_mm, "accuracy of the scanner's ranges, mm; its precision is 5 mm",
                  {5, 100});
  command.setting("--seed", o->seed, "seed of ground, places and noise", {0, 1e9});
  command.setting("--threads", o->threads, "number of threads that cast beams", {1, 256});
  command.footer(
      "Example: hueline calibrate targets-example --out example --stations 3 --points 1e6\n"
      "Exit status: 0; 4 if the scans cannot be written.\n"
      "More: docs/calibration.md");
  command.writes_into(o->out);
  command.runs([o] { return example(*o); });
}

}  // namespace hueline::apps
