// Compares panoramas that `hueline panorama --orientation head --format png` made of a simulated drive with the perfect
// panorama: what an eye at the true centre of the head sees. docs/panorama.md has the command and its figures.
//
//   panorama_proof SCENARIO SIM FOLDER [TRUTH [FILLED]]
//     prints the figures of the panoramas in FOLDER, which were made with --vehicle hide, and writes the perfect ones
//     into the folder TRUTH; FILLED: the same panoramas made with --vehicle fill
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "config/scenario.hpp"
#include "core/standard_streams.hpp"
#include "score/ciede2000.hpp"
#include "sim/generate.hpp"
#include "sim/rig_truth.hpp"
#include "sim/tone.hpp"
#include "sim/truth_file.hpp"
#include "sim/vehicle.hpp"
#include "sim/world.hpp"
#include "storage/png.hpp"

namespace hueline::apps::test {
namespace {

using sim::Vec3;

/// A direction of the head's frame: the middle column looks forward, columns run clockwise.
Vec3 direction_of(double u, double v, int width, int height) {
  const double azimuth = -((u + 0.5) / width - 0.5) * 2 * sim::kPi, polar = (v + 0.5) / height * sim::kPi;
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)};
}

/// The perfect panorama, and for each pixel whether it shows the own vehicle.
struct Perfect {
  storage::RgbImage picture;
  std::vector<std::uint8_t> is_own;
};

Perfect render(const sim::World& world, const sim::Moment& moment, const sim::Pose& T_enu_head, const sim::Tone& tone,
               int width, int height) {
  constexpr int kFine = 3;  // samples of a pixel's side
  Perfect out{storage::RgbImage(width, height, {}), std::vector<std::uint8_t>(std::size_t(width) * height)};
  std::atomic<int> next{0};
  const auto work = [&] {
    std::array<sim::World::Ray, kFine * kFine> rays;
    std::array<sim::Seen, kFine * kFine> seen;
    const auto cone = static_cast<float>(2 * sim::kPi / width / kFine);
    for (int v; (v = next.fetch_add(1)) < height;)
      for (int u = 0; u < width; ++u) {
        for (int i = 0; i < kFine * kFine; ++i) {
          const double du = (i % kFine + 0.5) / kFine - 0.5, dv = (i / kFine + 0.5) / kFine - 0.5;
          rays[static_cast<std::size_t>(i)] = {T_enu_head.p,
                                               T_enu_head.R * direction_of(u + du, v + dv, width, height)};
        }
        for (std::size_t at = 0; at < rays.size(); at += sim::World::kBatch) {
          const std::size_t count = std::min(sim::World::kBatch, rays.size() - at);
          world.look(moment, std::span(rays).subspan(at, count), cone, std::span(seen).subspan(at, count));
        }
        sim::Radiance light;
        for (const sim::Seen& one : seen) {
          light.r += one.colour.r / seen.size();
          light.g += one.colour.g / seen.size();
          light.b += one.colour.b / seen.size();
          if (one.is_hit && one.surface == 1) out.is_own[std::size_t(v) * width + u] = 1;
        }
        out.picture.at(u, v) = tone.perfect(light);
      }
  };
  std::vector<std::jthread> others;
  for (unsigned i = 1; i < std::max(1u, std::thread::hardware_concurrency()); ++i) others.emplace_back(work);
  work();
  others.clear();
  return out;
}

/// Where a pixel lies between the two lenses whose axes are nearest.
struct Seam {
  int best = 0, second = 0;
  double away_deg = 0;  // half the difference of the angles to the two axes
};

Seam seam_at(const std::vector<Vec3>& axes, Vec3 direction) {
  std::vector<std::pair<double, int>> angles;
  for (std::size_t i = 0; i < axes.size(); ++i)
    angles.emplace_back(std::acos(std::clamp(dot(axes[i], direction), -1.0, 1.0)), static_cast<int>(i));
  std::partial_sort(angles.begin(), angles.begin() + 2, angles.end());
  return {angles[0].second, angles[1].second, (angles[1].first - angles[0].first) / 2 * 180 / sim::kPi};
}

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return std::nan("");
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The figures of pixels in one part of the panoramas.
struct Figures {
  std::vector<double> differences;
  double square = 0;
  void add(storage::Rgb made, storage::Rgb truth, double difference) {
    differences.push_back(difference);
    for (std::size_t c = 0; c < 3; ++c) square += (made[c] - truth[c]) * (made[c] - truth[c]) / 3.0;
  }
  std::string text() {
    const auto count = static_cast<double>(differences.size());
    const auto over = std::count_if(differences.begin(), differences.end(), [](double d) { return d > 10; });
    const double psnr = 10 * std::log10(255 * 255 / (square / count)), median = quantile(differences, 0.5);
    return fmt::format("{:9} pixels  PSNR {:.2f} dB  dE00 median {:.2f} p95 {:.2f}  above 10: {:.4f}",
                       differences.size(), psnr, median, quantile(differences, 0.95),
                       static_cast<double>(over) / count);
  }
};

/// How far a block of the made panorama is displaced against the perfect one, px. Negative: the block has no structure
/// that tells, or part of it was not seen.
double displacement(const storage::RgbImage& made, const storage::RgbImage& perfect, int left, int top,
                    storage::Rgb fill) {
  constexpr int kSide = 16, kReach = 5;
  if (left < kReach || top < kReach || left + kSide + kReach > made.width || top + kSide + kReach > made.height)
    return -1;
  const auto light = [](storage::Rgb c) { return 0.3 * c[0] + 0.6 * c[1] + 0.1 * c[2]; };
  const auto spread_of = [&](int axis) {  // of the differences along an axis
    double sum = 0;
    for (int y = top; y < top + kSide; ++y)
      for (int x = left; x < left + kSide; ++x) {
        if (made.at(x, y) == fill) return -1.0;
        const double d = light(perfect.at(x + (axis == 0), y + (axis == 1))) - light(perfect.at(x, y));
        sum += d * d;
      }
    return std::sqrt(sum / (kSide * kSide));
  };
  if (spread_of(0) < 6 || spread_of(1) < 6) return -1;
  std::array<std::array<double, 2 * kReach + 1>, 2 * kReach + 1> alike;
  int best_x = 0, best_y = 0;
  for (int dy = -kReach; dy <= kReach; ++dy)
    for (int dx = -kReach; dx <= kReach; ++dx) {
      double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
      for (int y = top; y < top + kSide; ++y)
        for (int x = left; x < left + kSide; ++x) {
          const double m = light(made.at(x + dx, y + dy)), p = light(perfect.at(x, y));
          a += m, b += p, aa += m * m, bb += p * p, ab += m * p;
        }
      constexpr double kCount = kSide * kSide;
      const double value =
          (ab - a * b / kCount) / std::sqrt(std::max(1e-9, (aa - a * a / kCount) * (bb - b * b / kCount)));
      alike[static_cast<std::size_t>(dy + kReach)][static_cast<std::size_t>(dx + kReach)] = value;
      const double best = alike[static_cast<std::size_t>(best_y + kReach)][static_cast<std::size_t>(best_x + kReach)];
      if (value > best || (dy == -kReach && dx == -kReach)) best_x = dx, best_y = dy;
    }
  const auto at = [&](int dx, int dy) {
    return alike[static_cast<std::size_t>(dy + kReach)][static_cast<std::size_t>(dx + kReach)];
  };
  // Paving repeats itself: another place counts only if it is clearly more alike.
  if (at(best_x, best_y) < at(0, 0) + 0.03) best_x = best_y = 0;
  if (std::max(std::abs(best_x), std::abs(best_y)) == kReach) return kReach;
  if (at(best_x, best_y) < 0.7) return -1;
  // The top of a parabola through the neighbours.
  const auto finer = [](double before, double here, double after) {
    const double bend = before - 2 * here + after;
    return bend < 0 ? 0.5 * (before - after) / bend : 0.0;
  };
  return std::hypot(best_x + finer(at(best_x - 1, best_y), at(best_x, best_y), at(best_x + 1, best_y)),
                    best_y + finer(at(best_x, best_y - 1), at(best_x, best_y), at(best_x, best_y + 1)));
}

int judge(const std::vector<std::string>& words) {
  const sim::Scenario scenario = config::load_scenario(words.at(0));
  const auto drive = sim::generate(scenario, words.at(1));
  if (!drive.ok()) return std::fprintf(stderr, "%s\n", drive.error().message.c_str()), 1;
  const auto truth = sim::TruthReader::open(drive->cache_dir + "/truth.bin");
  if (!truth.ok()) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 1;
  const sim::Motion motion(scenario);
  const sim::World world(scenario, motion);
  const sim::RigTruth rig = sim::rig_truth(scenario);
  std::vector<Vec3> axes;
  for (const sim::TrueLens& lens : rig.lenses) axes.push_back(lens.T_head_lens.R * Vec3{0, 0, 1});
  const score::LabOfRgb lab(scenario.camera.tone_curve == sim::ToneCurve::Linear ? score::LabOfRgb::Encoding::Linear
                                                                                 : score::LabOfRgb::Encoding::Srgb);
  constexpr double kSeam_deg = 3;  // pixels so near to a seam count as beside it
  Figures seams, elsewhere, holes;
  std::uint64_t hidden = 0, filled = 0;
  std::vector<double> steps, displaced_deg;
  std::ifstream table(words.at(2) + "/panoramas.csv");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::string file, exposure, gps_s;
    std::getline(fields, file, ',');
    std::getline(fields, exposure, ',');
    std::getline(fields, gps_s, ',');
    const auto gps_ns = static_cast<sim::GpsNs>(std::stold(gps_s) * 1e9L);
    const auto& exposures = truth->header().exposures;
    const auto& shot = *std::min_element(exposures.begin(), exposures.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.exposure_mid_gps_ns - gps_ns) < std::abs(b.exposure_mid_gps_ns - gps_ns);
    });
    const auto made = storage::read_png(words.at(2) + "/" + file);
    if (!made.ok()) return std::fprintf(stderr, "%s\n", made.error().message.c_str()), 1;
    const sim::Moment moment = world.moment(shot.exposure_mid_gps_ns);
    // A camera does not know how bright the world is: the program makes lenses even around their mean.
    double gain = scenario.camera.gain;
    for (const float one : shot.lens_gain)
      gain *= std::pow(static_cast<double>(one), 1.0 / static_cast<double>(shot.lens_gain.size()));
    const Perfect perfect = render(world, moment, moment.T_enu_body * rig.T_body_head,
                                   sim::Tone(scenario.camera.tone_curve, gain), made->width, made->height);
    if (words.size() > 3) {
      std::filesystem::create_directories(words[3]);
      if (!storage::write_png(words[3] + "/" + file, perfect.picture).ok()) return 1;
    }
    if (words.size() > 4) {
      const auto without_hole = storage::read_png(words[4] + "/" + file);
      if (!without_hole.ok()) return std::fprintf(stderr, "%s\n", without_hole.error().message.c_str()), 1;
      // The same world without the own vehicle and its shadow.
      sim::Moment empty = moment;
      empty.T_enu_body.p.z += 1e4;
      empty.T_body_enu = inverse(empty.T_enu_body);
      const Perfect road = render(world, empty, moment.T_enu_body * rig.T_body_head,
                                  sim::Tone(scenario.camera.tone_curve, gain), made->width, made->height);
      const storage::Rgb fill = made->at(made->width / 2, made->height - 1);
      for (int v = 0; v < made->height; ++v)
        for (int u = 0; u < made->width; ++u) {
          if (made->at(u, v) != fill) continue;
          ++hidden;
          const storage::Rgb is = without_hole->at(u, v), should = road.picture.at(u, v);
          if (is == fill) continue;
          ++filled;
          holes.add(is, should, score::ciede2000(lab(is), lab(should)));
        }
    }
    // The error of the lightness on both sides of each seam, in parts of five degrees of elevation.
    std::map<std::array<int, 3>, std::array<std::pair<double, int>, 2>> sides;
    const storage::Rgb fill = made->at(made->width / 2, made->height - 1);
    for (int v = 0; v < made->height; ++v)
      for (int u = 0; u < made->width; ++u) {
        const storage::Rgb is = made->at(u, v), should = perfect.picture.at(u, v);
        if (is == fill || perfect.is_own[std::size_t(v) * made->width + u]) continue;
        // Saturated pixels say nothing.
        if (*std::max_element(should.begin(), should.end()) == 255) continue;
        const Seam seam = seam_at(axes, direction_of(u, v, made->width, made->height));
        const score::Lab a = lab(is), b = lab(should);
        (seam.away_deg < kSeam_deg ? seams : elsewhere).add(is, should, score::ciede2000(a, b));
        if (seam.away_deg < 0.5 || seam.away_deg > 3) continue;
        auto& side = sides[{std::min(seam.best, seam.second), std::max(seam.best, seam.second), v * 36 / made->height}]
                          [seam.best < seam.second];
        side.first += a.L - b.L;
        ++side.second;
      }
    for (int v = 0; v < made->height; v += 8)
      for (int u = 0; u < made->width; u += 8) {
        if (seam_at(axes, direction_of(u + 7.5, v + 7.5, made->width, made->height)).away_deg > kSeam_deg) continue;
        const double px = displacement(*made, perfect.picture, u, v, fill);
        if (px >= 0) displaced_deg.push_back(px * 360 / made->width);
      }
    for (const auto& [where, two] : sides)
      if (two[0].second > 20 && two[1].second > 20)
        steps.push_back(std::abs(two[0].first / two[0].second - two[1].first / two[1].second));
  }
  if (seams.differences.empty()) return std::fprintf(stderr, "no panorama in %s\n", words.at(2).c_str()), 1;
  const std::string beside = seams.text(), others = elsewhere.text();
  const auto displaced = std::count_if(displaced_deg.begin(), displaced_deg.end(), [](double d) { return d > 0.2; });
  std::printf(
      "beside seams %s\nelsewhere    %s\nstep of L* across seams: median %.3f p90 %.3f of %zu parts\n"
      "displacement beside seams, deg: median %.4f p90 %.4f, above 0.2: %.4f of %zu blocks\n",
      beside.c_str(), others.c_str(), quantile(steps, 0.5), quantile(steps, 0.9), steps.size(),
      quantile(displaced_deg, 0.5), quantile(displaced_deg, 0.9),
      static_cast<double>(displaced) / static_cast<double>(displaced_deg.size()), displaced_deg.size());
  if (hidden > 0)
    std::printf("hidden by the vehicle: %.4f of it filled\n             %s\n",
                static_cast<double>(filled) / static_cast<double>(hidden), holes.text().c_str());
  return 0;
}

}  // namespace
}  // namespace hueline::apps::test

int main(int argc, char** argv) {
  hueline::open_standard_streams();
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 3) return std::fprintf(stderr, "usage: panorama_proof SCENARIO SIM FOLDER [TRUTH [FILLED]]\n"), 2;
  try {
    return hueline::apps::test::judge(words);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "panorama_proof: %s\n", error.what()), 1;
  }
}
