// Simulates stations like those of the published work with their truth. It reports which targets are found, what is
// kept falsely, and how wrong the oriented scans are, compared with the Cramer-Rao bound of the same noise and hits.
// docs/calibration.md has the command and its figures.
#include <fmt/format.h>

#include <Eigen/LU>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "apps/calibrate/calibrate_targets.hpp"
#include "core/standard_streams.hpp"
#include "tests/calibration/targets/simulated_scan.hpp"

namespace hueline::calibration {
namespace {

/// One difference, with the covariance of its own target's centre and its derivative by the station's pose.
struct Difference {
  Eigen::Vector3d off;
  Eigen::Matrix3d own;
  Eigen::Matrix<double, 3, 6> lever;
};

/// Sums of squared differences in plane and height, with the values that the bound expects and their standard deviation
/// by chance.
struct Differences {
  struct Sum {
    double square = 0, expected = 0, variance = 0;  // m^2, m^2, m^4
    /// Returns the rms over its bound. chance() returns the standard deviation of that ratio if the bound is met
    /// exactly.
    double ratio() const { return expected > 0 ? std::sqrt(square / expected) : 0; }
    double chance() const { return expected > 0 ? std::sqrt(variance) / (2 * expected) : 0; }
  };
  Sum plane, space, height;
  std::size_t count = 0;

  /// Adds all differences of a station together, because they share its pose with the covariance Q. `pose_sign` is -1
  /// if the pose was fitted to them.
  void add(const std::vector<Difference>& all, const Eigen::Matrix<double, 6, 6>& Q, double pose_sign) {
    for (std::size_t i = 0; i < all.size(); ++i)
      for (std::size_t j = 0; j < all.size(); ++j) {
        Eigen::Matrix3d c = pose_sign * all[i].lever * Q * all[j].lever.transpose();
        if (i == j) c += all[i].own;
        // A sum of squares of normal values with covariance C has the variance 2 tr(C C).
        plane.variance += 2 * c.topLeftCorner<2, 2>().squaredNorm();
        space.variance += 2 * c.squaredNorm();
        height.variance += 2 * c(2, 2) * c(2, 2);
        if (i != j) continue;
        plane.expected += c(0, 0) + c(1, 1);
        space.expected += c.trace();
        height.expected += c(2, 2);
        plane.square += all[i].off.head<2>().squaredNorm();
        space.square += all[i].off.squaredNorm();
        height.square += all[i].off.z() * all[i].off.z();
        ++count;
      }
  }
  std::string row(const char* what) const {
    const auto part = [&](const char* name, const Sum& sum) {
      const auto rms = [&](double square) {
        return 1000 * std::sqrt(square / static_cast<double>(std::max<std::size_t>(count, 1)));
      };
      return fmt::format("  {} {:5.2f} (bound {:5.2f}: {:4.2f} x, chance {:4.2f})", name, rms(sum.square),
                         rms(sum.expected), sum.ratio(), sum.chance());
    };
    return fmt::format("{:<52} {:>4}{}{}{} mm\n", what, count, part("plane", plane), part("space", space),
                       part("height", height));
  }
};

struct Tally {
  std::size_t stations = 0, refused = 0, targets = 0, hit = 0, found = 0, missed = 0, false_kept = 0, decoys = 0,
              candidates = 0;
  std::uint64_t points = 0;
  Differences used, checks_survey, checks_truth;
};

Eigen::Matrix3d matrix(const std::array<double, 9>& m) {
  Eigen::Matrix3d out;
  out << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  return out;
}

/// Returns the bound of one centre from its hits and from the range error that they share.
Eigen::Matrix3d centre_bound(const SimulatedStation& station, std::size_t i) {
  const Eigen::Vector3d sight = eigen(station.site->spheres[i].centre).normalized();
  const double common = station.site->config.common_range_sigma_m;
  return matrix(station.truth[i].information).inverse() + common * common * sight * sight.transpose();
}

void judge(const SimulatedStation& station, const Result<StationResult>& result, Tally& tally, bool verbose) {
  const sim::StaticSite& site = *station.site;
  ++tally.stations;
  tally.points += station.xyz.size() / 3;
  for (const auto& sphere : site.spheres) tally.decoys += sphere.kind == sim::SphereKind::Decoy;
  const double survey = site.config.survey_sigma_m * site.config.survey_sigma_m;
  // The information about the pose from the targets that take part, about the site's axes.
  Eigen::Matrix<double, 6, 6> N = Eigen::Matrix<double, 6, 6>::Zero();
  const auto lever = [](const Eigen::Vector3d& p) {
    Eigen::Matrix<double, 3, 6> A;
    A << 0, p.z(), -p.y(), 1, 0, 0, -p.z(), 0, p.x(), 0, 1, 0, p.y(), -p.x(), 0, 0, 0, 1;
    return A;
  };
  std::size_t row = 0;
  for (std::size_t i = 0; i < site.spheres.size(); ++i) {
    if (site.spheres[i].kind != sim::SphereKind::Orientation || station.truth[i].hits < 4) continue;
    const auto A = lever(eigen(site.spheres[i].centre));
    N += A.transpose() * (centre_bound(station, i) + survey * Eigen::Matrix3d::Identity()).inverse() * A;
  }
  const Eigen::Matrix<double, 6, 6> Q = N.inverse();
  if (!result.ok()) {
    ++tally.refused;
    std::printf("%s refused: %s\n", site.name.c_str(), result.error().message.c_str());
  }
  const Eigen::Vector3d place = eigen(site.place_survey);
  std::vector<Difference> used, checks_survey, checks_truth;
  for (std::size_t i = 0; i < site.spheres.size(); ++i) {
    const sim::StaticSphere& sphere = site.spheres[i];
    if (sphere.kind == sim::SphereKind::Decoy) continue;
    ++tally.targets;
    const bool is_hit = station.truth[i].hits >= 4;
    tally.hit += is_hit;
    if (!result.ok()) {
      tally.missed += is_hit;
      continue;
    }
    const TargetOutcome& outcome = result->targets[row++];
    tally.candidates += outcome.counts.candidates;
    if (verbose)
      std::printf("%s %-8s %6.1f m  hits %5llu  points %5zu  ring %7zu  candidates %4zu  %s %s\n", site.name.c_str(),
                  sphere.name.c_str(), eigen(sphere.centre).norm(),
                  static_cast<unsigned long long>(station.truth[i].hits), outcome.points, outcome.counts.points,
                  outcome.counts.candidates, name(outcome.state), outcome.reason.c_str());
    if (!outcome.is_found()) {
      tally.missed += is_hit;
      if (is_hit)
        std::printf("missed: %s with %llu hits: %s\n", sphere.name.c_str(),
                    static_cast<unsigned long long>(station.truth[i].hits), outcome.reason.c_str());
      continue;
    }
    // The target must be found at its true place in the scanner's frame. Otherwise it is another object.
    const sim::Vec3 true_scanner = sim::transposed(site.R_site_scanner) * sphere.centre;
    if ((outcome.centre_scanner - eigen(true_scanner)).norm() > 0.06) {
      ++tally.false_kept;
      std::printf("false: %s, %.3f m off\n", sphere.name.c_str(),
                  (outcome.centre_scanner - eigen(true_scanner)).norm());
      continue;
    }
    tally.found += is_hit;
    if (!is_hit) continue;
    const auto A = lever(eigen(sphere.centre));
    const Eigen::Matrix3d centre = centre_bound(station, i);
    const Eigen::Matrix3d surveyed = centre + survey * Eigen::Matrix3d::Identity();
    if (outcome.state == TargetState::Used) {
      used.push_back({outcome.residual_survey, surveyed, A});
    } else {
      checks_survey.push_back({outcome.residual_survey, surveyed, A});
      checks_truth.push_back(
          {result->adjusted.orientation.survey_from_scanner(outcome.centre_scanner) - (place + eigen(sphere.centre)),
           centre, A});
    }
    if (verbose) {
      const Difference& last = outcome.state == TargetState::Used ? used.back() : checks_truth.back();
      const Eigen::Matrix3d c = last.own + (outcome.state == TargetState::Used ? -1 : 1) * (A * Q * A.transpose());
      std::printf(
          "%s %-8s off %6.1f %6.1f %6.1f mm, in its bound's sigma %5.2f %5.2f %5.2f, together %.1f (3 expected)\n",
          site.name.c_str(), sphere.name.c_str(), 1e3 * last.off.x(), 1e3 * last.off.y(), 1e3 * last.off.z(),
          last.off.x() / std::sqrt(c(0, 0)), last.off.y() / std::sqrt(c(1, 1)), last.off.z() / std::sqrt(c(2, 2)),
          last.off.dot(c.inverse() * last.off));
    }
  }
  tally.used.add(used, Q, -1);
  tally.checks_survey.add(checks_survey, Q, 1);
  tally.checks_truth.add(checks_truth, Q, 1);
}

void report(const char* method, const Tally& t) {
  std::printf(
      "%s: %zu stations (%zu refused), %.1f M points; %zu targets, %zu hit by 4 points or more: %zu found, %zu missed; "
      "%zu decoys, %.1f candidates a ring: %zu false ones kept\n",
      method, t.stations, t.refused, static_cast<double>(t.points) * 1e-6, t.targets, t.hit, t.found, t.missed,
      t.decoys, static_cast<double>(t.candidates) / static_cast<double>(std::max<std::size_t>(t.targets, 1)),
      t.false_kept);
  std::printf("%s%s%s", t.used.row("  residuals at orientation targets, against survey").c_str(),
              t.checks_survey.row("  check targets, against survey").c_str(),
              t.checks_truth.row("  check targets, against truth").c_str());
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double peak_memory_mb() {
  std::ifstream in("/proc/self/status");
  for (std::string word; in >> word;)
    if (word == "VmHWM:") {
      double kb = 0;
      in >> kb;
      return kb / 1024;
    }
  return 0;
}

/// Runs one station of `points` points on disk and compares the time with reading and writing alone, in the same run.
int time_on_disk(const std::string& folder, std::uint64_t points, std::uint64_t seed) {
  sim::StaticSiteConfig config;
  config.seed = seed;
  SimulatedStation station;
  station.site = std::make_shared<sim::StaticSite>(sim::make_static_site(config));
  sim::StaticScannerConfig scanner;
  scanner.window_step_deg = 0;
  scanner.step_deg = 0.995 * sim::step_for_points(*station.site, scanner, points);
  const std::string path = folder + "/targets_proof.f32";
  auto begin = std::chrono::steady_clock::now();
  station.truth.resize(station.site->spheres.size());
  const auto written = sim::write_static_scan(sim::StaticScan(*station.site, scanner), path, points, 2, station.truth);
  if (!written.ok()) return std::printf("%s\n", written.error().message.c_str()), 1;
  std::printf("%llu points (%.2f GB), step %.4f deg, simulated and written in %.1f s; peak memory %.0f MB\n",
              static_cast<unsigned long long>(*written), 12e-9 * static_cast<double>(*written), scanner.step_deg,
              seconds_since(begin), peak_memory_mb());
  const SurveyedStation places[] = {station.station()};
  const auto surveyed = station.targets();
  Result<StationResult> result = Error{};
  for (int round = 0; round < 3; ++round) {
    begin = std::chrono::steady_clock::now();
    {
      const auto file = InputFile::open(path);
      std::vector<std::byte> block(1 << 20);
      for (std::uint64_t at = 0; file.ok() && at < file->size(); at += block.size())
        if (!file->read(at, std::span(block).first(
                                static_cast<std::size_t>(std::min<std::uint64_t>(block.size(), file->size() - at))))
                 .ok())
          return 1;
    }
    const double reading = seconds_since(begin);
    begin = std::chrono::steady_clock::now();
    const auto scan = storage::ScanFile::open(path);
    if (!scan.ok()) return 1;
    result = orient_station(apps::ScanFileBlocks(*scan), places, 0, surveyed, {});
    const double whole = seconds_since(begin);
    std::printf("read once %.3f s; read to orientation %.3f s: %.2f times (at most 2); peak memory %.0f MB\n", reading,
                whole, whole / reading, peak_memory_mb());
    if (!result.ok()) return std::printf("%s\n", result.error().message.c_str()), 1;
    // The time of writing alone: the same bytes to another file.
    const Eigen::Vector3d origin = result->adjusted.orientation.T_survey_scanner.translation.array().round();
    begin = std::chrono::steady_clock::now();
    {
      auto copy = storage::FileWriter::create(folder + "/targets_proof_copy.f32", storage::IfExists::Replace);
      const std::vector<std::byte> block(1 << 20);
      for (std::uint64_t left = 12 * *written; copy.ok() && left > 0;
           left -= std::min<std::uint64_t>(left, block.size()))
        if (!copy->write(std::span(block).first(static_cast<std::size_t>(std::min<std::uint64_t>(left, block.size()))))
                 .ok())
          return 1;
      if (!copy.ok() || !copy->close().ok()) return 1;
    }
    const double writing = seconds_since(begin);
    std::remove((folder + "/targets_proof_copy.f32").c_str());
    begin = std::chrono::steady_clock::now();
    if (!apps::write_oriented(*scan, result->adjusted.orientation, origin, storage::ScanCloudWriter::Format::Float32,
                              folder + "/targets_proof_oriented.f32", {})
             .ok())
      return 1;
    const double with_cloud = whole + seconds_since(begin);
    std::remove((folder + "/targets_proof_oriented.f32").c_str());
    std::printf("write once %.3f s; with the oriented cloud %.3f s: %.2f times read + write (at most 2)\n", writing,
                with_cloud, with_cloud / (reading + writing));
  }
  Tally tally;
  station.xyz.clear();
  judge(station, result, tally, true);
  report("hueline", tally);
  std::remove(path.c_str());
  return tally.missed + tally.false_kept == 0 ? 0 : 1;
}

int run(int argc, char** argv) {
  int stations = 47, first = 0;
  std::uint64_t seed = 1;
  double accuracy = 0.008;
  bool verbose = false;
  std::string folder;
  std::uint64_t disk_points = 107'151'326;
  sim::StaticScannerConfig scanner;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] { return i + 1 < argc ? std::atof(argv[++i]) : 0; };
    if (word == "--stations")
      stations = static_cast<int>(value());
    else if (word == "--first")
      first = static_cast<int>(value()) - 1;
    else if (word == "--seed")
      seed = static_cast<std::uint64_t>(value());
    else if (word == "--accuracy-mm")
      accuracy = value() / 1000;
    else if (word == "--window-deg")
      scanner.window_step_deg = value();
    else if (word == "--points")
      disk_points = static_cast<std::uint64_t>(value());
    else if (word == "--disk" && i + 1 < argc)
      folder = argv[++i];
    else if (word == "--verbose")
      verbose = true;
    else {
      std::printf(
          "targets_proof [--stations 47] [--first 1] [--seed 1] [--accuracy-mm 8] [--window-deg 0.0135] "
          "[--verbose]\ntargets_proof --disk FOLDER [--points 107151326] [--seed 1]\n");
      return word == "--help" ? 0 : 2;
    }
  }
  if (!folder.empty()) return time_on_disk(folder, disk_points, seed);
  Tally ours, published;
  double seconds = 0;
  for (int i = first; i < first + stations; ++i) {
    sim::StaticSiteConfig config;
    config.seed = seed;
    config.station = i;
    config.radius_m = i % 2 ? 0.145 : 0.0725;
    TargetsConfig targets;
    targets.noise.range_accuracy_m = accuracy;
    config.common_range_sigma_m = targets.noise.common_range_sigma_m();
    const SimulatedStation station = simulate_station(config, scanner);
    const MemoryScan scan(station.xyz);
    const std::vector<SurveyedTarget> surveyed = station.targets();
    const SurveyedStation places[] = {station.station()};
    const auto begin = std::chrono::steady_clock::now();
    judge(station, orient_station(scan, places, 0, surveyed, targets), ours, verbose);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    targets.method = CentreMethod::LinearFit;
    judge(station, orient_station(scan, places, 0, surveyed, targets), published, false);
  }
  report("as published", published);
  report("hueline", ours);
  std::printf("%.2f s a station without reading\n", seconds / stations);
  return ours.missed + ours.false_kept == 0 ? 0 : 1;
}

}  // namespace
}  // namespace hueline::calibration

int main(int argc, char** argv) {
  hueline::open_standard_streams();
  return hueline::calibration::run(argc, argv);
}
