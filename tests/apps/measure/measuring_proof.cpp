// Measures objects through the panorama with a rig that the calibration tools have found, and compares them with the
// simulator's truth. tests/apps/measure/measure_test.sh shows the steps; docs/calibration.md has the command and its
// figures.
//
//   measuring_proof inputs SCENARIO OUT VIEWS POINTS [PANORAMA_WIDTH [LENSES]]
//     writes the boards, points.csv, nominal.yaml and true.yaml
//   measuring_proof picks SCENARIO SIM RIG OUT COUNT [PICK_PX [nearest|any [CLEAR_PX]]]
//     writes picks.csv and truth.csv
//   measuring_proof judge MEASURED.csv TRUTH.csv [MOST_PLANE_RMS_M]
//     compares the measured coordinates with the truth
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "apps/simulate/simulated_rig.hpp"
#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "core/standard_streams.hpp"
#include "fusion/panorama.hpp"
#include "sim/earth.hpp"
#include "sim/generate.hpp"
#include "sim/noise.hpp"
#include "sim/truth_file.hpp"
#include "sim/visibility.hpp"
#include "tests/apps/measure/measuring_inputs.hpp"

namespace hueline::apps::test {
namespace {

using sim::Vec3;
constexpr std::uint64_t kStream = 0x7069636Bull;

bool write(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  if (!out) std::fprintf(stderr, "%s: cannot be written\n", path.c_str());
  return bool(out);
}

int inputs(const std::vector<std::string>& words) {
  const sim::Scenario scenario = config::load_scenario(words.at(0));
  const sim::RigTruth rig = sim::rig_truth(scenario);
  const std::string out = words.at(1);
  const auto panorama = words.size() > 4 ? static_cast<std::uint32_t>(std::stoi(words[4])) : 8000u;
  const std::size_t lenses = words.size() > 5 ? static_cast<std::size_t>(std::stoi(words[5])) : rig.lenses.size();
  for (std::size_t i = 0; i < std::min(lenses, rig.lenses.size()); ++i)
    if (const Status done =
            write_board_images(rig, i, std::stoi(words.at(2)), scenario.seed, fmt::format("{}/boards/lens{}", out, i));
        !done.ok()) {
      std::fprintf(stderr, "%s\n", done.error().message.c_str());
      return 1;
    }
  return write(out + "/points.csv", mount_points(rig, std::stoi(words.at(3)), scenario.seed)) &&
                 write(out + "/nominal.yaml", nominal_rig(scenario, panorama)) &&
                 write(out + "/true.yaml", simulated_rig(scenario, {}, "lens"))
             ? 0
             : 1;
}

/// Returns false for what nobody measures: moving objects and single leaves.
bool is_object(const std::string& surface, const sim::World& world, std::uint16_t id) {
  return id > 1 && !world.is_moving(id) && surface.rfind("crown", 0) != 0 && surface.rfind("flowers", 0) != 0;
}

/// Returns true if the lens sees the same object in eight directions around the pixel. An operator does not pick what
/// shows between two leaves.
bool is_clear(const sim::World& world, const sim::Moment& moment, const sim::TrueLens& lens,
              const sim::Pose& T_enu_lens, sim::TruePixel pixel, double around_px, std::uint16_t surface) {
  for (int k = 0; k < 8 && around_px > 0; ++k) {
    const auto direction =
        lens.ray(pixel.u + around_px * std::cos(k * sim::kPi / 4), pixel.v + around_px * std::sin(k * sim::kPi / 4));
    if (!direction) return false;
    const sim::World::Ray ray{T_enu_lens.p, T_enu_lens.R * *direction, 0.01, 200};
    sim::Seen seen;
    world.look(moment, std::span(&ray, 1), 0, std::span(&seen, 1));
    if (seen.surface != surface) return false;
  }
  return true;
}

/// Returns a limited number of true returns of each object, spread over the drive.
Result<std::map<std::uint16_t, std::vector<sim::TrueReturn>>> objects_of(sim::TruthReader& truth,
                                                                         const sim::World& world, std::uint64_t seed) {
  constexpr std::uint64_t kEach = 400;
  std::map<std::uint16_t, std::vector<sim::TrueReturn>> out;
  std::map<std::uint16_t, std::uint64_t> seen;
  for (std::uint64_t index = 0;;) {
    const auto packet = truth.next_packet();
    if (!packet.ok() && packet.error().code == ErrorCode::EndOfData) return out;
    if (!packet.ok()) return packet.error();
    for (const sim::TrueReturn& one : *packet) {
      ++index;
      if (!is_object(truth.header().surfaces.at(one.surface), world, one.surface)) continue;
      // Reservoir sampling: each return of an object is kept with the same probability.
      const std::uint64_t place = sim::counter_bits(seed, kStream, index) % ++seen[one.surface];
      auto& mine = out[one.surface];
      if (mine.size() < kEach)
        mine.push_back(one);
      else if (place < kEach)
        mine[place] = one;
    }
  }
}

int picks(const std::vector<std::string>& words) {
  const sim::Scenario scenario = config::load_scenario(words.at(0));
  const auto drive = sim::generate(scenario, words.at(1));
  const config::Rig rig = config::load_rig(words.at(2));
  const std::size_t count = static_cast<std::size_t>(std::stoi(words.at(4)));
  const double noise_px = words.size() > 5 ? std::stod(words[5]) : 0.5, farthest_m = 30;
  const bool is_nearest = words.size() < 7 || words[6] == "nearest";
  const double clear_px = words.size() > 7 ? std::stod(words[7]) : 3;
  auto truth =
      drive.ok() ? sim::TruthReader::open(drive->cache_dir + "/truth.bin") : Result<sim::TruthReader>(drive.error());
  if (!truth.ok()) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 1;
  const sim::Motion motion(scenario);
  const sim::World world(scenario, motion);
  const sim::Visibility visibility(scenario, motion, world, truth->header().exposures);
  const sim::RigTruth true_rig = sim::rig_truth(scenario);
  const auto objects = objects_of(*truth, world, scenario.seed);
  if (!objects.ok()) return std::fprintf(stderr, "%s\n", objects.error().message.c_str()), 1;

  const fusion::StitchedPanorama panorama(rig.geometry.head);
  const auto& header = truth->header();
  const sim::GeodeticPlace origin{header.origin_latitude_rad, header.origin_longitude_rad, header.origin_height_m};
  const Vec3 origin_ecef = sim::ecef_from_geodetic(origin);
  const sim::Mat3 R_ecef_scene = sim::R_ecef_enu(origin);
  std::string picked = "name,exposure,u_px,v_px\n",
              known = "name,x_ecef_m,y_ecef_m,z_ecef_m,exposed_gps_s,distance_m,surface\n";
  std::size_t made = 0, unseen = 0;
  std::uint64_t draw = 0;
  const auto uniform = [&] { return sim::uniform(scenario.seed, kStream + 1, draw++); };
  for (std::size_t round = 0; made < count && round < 400; ++round)
    for (const auto& [surface, returns] :
         *objects) {  // each thing in its turn: a road has more returns than a lamp post
      if (made == count || round >= returns.size()) continue;
      const sim::TrueReturn& object = returns[round];
      const Vec3 p{object.east, object.north, object.up};
      std::vector<std::pair<double, std::size_t>> order;
      for (std::size_t k = 0; k < header.exposures.size(); ++k) {
        const auto& h = header.exposures[k].p_enu_head;
        const double distance = sim::length(p - Vec3{h[0], h[1], h[2]});
        if (distance <= farthest_m) order.emplace_back(is_nearest ? distance : uniform(), k);
      }
      std::sort(order.begin(), order.end());
      bool done = false;
      for (std::size_t place = 0; place < order.size() && !done; ++place) {
        const std::size_t k = order[place].second;
        const sim::TrueExposure& exposure = header.exposures[k];
        const sim::Pose T_enu_head{{exposure.R_enu_head},
                                   {exposure.p_enu_head[0], exposure.p_enu_head[1], exposure.p_enu_head[2]}};
        for (std::size_t i = 0; i < true_rig.lenses.size() && !done; ++i) {
          const sim::TrueLens& lens = true_rig.lenses[i];
          const auto pixel = lens.project(sim::inverse(T_enu_head * lens.T_head_lens) * p);
          if (!pixel || !lens.contains(*pixel) || !visibility.is_visible(object, i, exposure.number)) continue;
          if (!is_clear(world, world.moment(exposure.exposure_mid_gps_ns), lens, T_enu_head * lens.T_head_lens, *pixel,
                        clear_px, object.surface))
            continue;
          // The place at which the user's panorama, stitched with the rig of his calibration, shows this pixel, if it
          // shows it.
          const auto at = panorama.panorama_pixel({static_cast<int>(i), {pixel->u, pixel->v}});
          const auto back = at ? panorama.lens_pixel(*at) : std::nullopt;
          if (!back || back->lens != static_cast<int>(i)) continue;
          const Vec3 ecef = R_ecef_scene * p + origin_ecef;
          const double du = noise_px * sim::gaussian(scenario.seed, kStream + 2, 2 * made),
                       dv = noise_px * sim::gaussian(scenario.seed, kStream + 2, 2 * made + 1);
          const auto& shape = rig.geometry.head.panorama;
          const double u = std::clamp(at->x() + du, -0.49, shape.width - 0.51),
                       v = std::clamp(at->y() + dv, -0.49, shape.height - 0.51);
          picked += fmt::format("o{},{},{:.3f},{:.3f}\n", ++made, exposure.number, u, v);
          known += fmt::format("o{},{:.5f},{:.5f},{:.5f},{:.6f},{:.3f},{}\n", made, ecef.x, ecef.y, ecef.z,
                               static_cast<double>(exposure.exposure_mid_gps_ns / 1000) * 1e-6,
                               sim::length(p - T_enu_head.p), header.surfaces.at(surface));
          done = true;
        }
      }
      unseen += !done;
    }
  std::printf("%zu objects picked on %zu things; %zu others are in no panorama\n", made, objects->size(), unseen);
  return write(words.at(3) + "/picks.csv", picked) && write(words.at(3) + "/truth.csv", known) ? 0 : 1;
}

using Row = std::map<std::string, std::string>;

std::vector<Row> read_table(const std::string& path) {
  std::ifstream in(path);
  std::vector<std::string> names;
  std::vector<Row> out;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> cells(1);
    for (const char c : line)
      if (c == ',')
        cells.emplace_back();
      else
        cells.back() += c;
    if (names.empty()) {
      names = cells;
      continue;
    }
    Row row;
    for (std::size_t i = 0; i < names.size() && i < cells.size(); ++i) row[names[i]] = cells[i];
    out.push_back(row);
  }
  return out;
}

struct Errors {
  double plane2 = 0, height2 = 0, largest = 0;
  std::size_t count = 0;
  void add(Vec3 off) {
    plane2 += off.x * off.x + off.y * off.y;
    height2 += off.z * off.z;
    largest = std::max(largest, std::hypot(off.x, off.y));
    ++count;
  }
  double plane_rms() const { return count ? std::sqrt(plane2 / static_cast<double>(count)) : 0; }
  std::string text() const {
    return fmt::format("{:5} points  plane {:.4f} m rms (largest {:.3f})  height {:.4f} m rms", count, plane_rms(),
                       largest, count ? std::sqrt(height2 / static_cast<double>(count)) : 0);
  }
};

/// Returns the kind of a surface: its name without its number.
std::string kind(const std::string& surface) { return surface.substr(0, surface.find_last_not_of(" 0123456789") + 1); }

/// Returns a reason without its figures.
std::string without_numbers(const std::string& why) {
  std::string out;
  for (const char c : why)
    if (!(std::isdigit(static_cast<unsigned char>(c)) || (c == '.' && !out.empty() && out.back() == '#')))
      out += c;
    else if (out.empty() || out.back() != '#')
      out += '#';
  return out;
}

int judge(const std::vector<std::string>& words) {
  const auto measured = read_table(words.at(0)), truth = read_table(words.at(1));
  const double most = words.size() > 2 ? std::stod(words[2]) : 0;
  if (measured.size() != truth.size() || truth.empty())
    return std::fprintf(stderr, "%zu rows measured, %zu known\n", measured.size(), truth.size()), 1;
  Errors all, first13, sharp;
  std::map<int, Errors> by_distance;
  std::map<std::string, Errors> by_kind;
  std::map<std::string, std::size_t> reasons, unmeasured;
  std::vector<std::pair<double, std::string>> worst;
  std::size_t within = 0;
  double normalised = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Row &m = measured[i], &t = truth[i];
    if (m.at("name") != t.at("name"))
      return std::fprintf(stderr, "row %zu: %s is held against %s\n", i, m.at("name").c_str(), t.at("name").c_str()), 1;
    if (!m.at("exposed_gps_s").empty() &&
        std::abs(std::stod(m.at("exposed_gps_s")) - std::stod(t.at("exposed_gps_s"))) > 1e-3)
      return std::fprintf(stderr, "%s: another exposure than was picked in\n", t.at("name").c_str()), 1;
    if (m.at("east_m").empty()) {
      ++reasons[without_numbers(m.at("why_not"))];
      ++unmeasured[kind(t.at("surface"))];
      continue;
    }
    const sim::GeodeticPlace place{sim::radians(std::stod(m.at("latitude_deg"))),
                                   sim::radians(std::stod(m.at("longitude_deg"))), std::stod(m.at("height_m"))};
    const Vec3 known{std::stod(t.at("x_ecef_m")), std::stod(t.at("y_ecef_m")), std::stod(t.at("z_ecef_m"))};
    const Vec3 off = sim::transposed(sim::R_ecef_enu(place)) * (sim::ecef_from_geodetic(place) - known);
    all.add(off);
    if (all.count <= 13) first13.add(off);
    const double distance = std::stod(t.at("distance_m"));
    by_distance[static_cast<int>(distance / 5) * 5].add(off);
    by_kind[kind(t.at("surface"))].add(off);
    const double sigma = std::hypot(std::stod(m.at("sigma_east_m")), std::stod(m.at("sigma_north_m")));
    if (sigma <= 0.05) sharp.add(off);
    within += std::hypot(off.x, off.y) <= 3 * sigma;
    normalised += (off.x * off.x + off.y * off.y) / (sigma * sigma);
    worst.emplace_back(
        std::hypot(off.x, off.y),
        fmt::format("{} {} at {:.1f} m: {:.3f} {:.3f} {:.3f} m, stated {:.3f}, oblique {}, scatter {}", t.at("name"),
                    t.at("surface"), distance, off.x, off.y, off.z, sigma, m.at("oblique_deg"), m.at("scatter_m")));
  }
  fmt::print("first 13 measured:           {}\nall measured:                {}\nstated to 0.05 m or better:  {}\n",
             first13.text(), all.text(), sharp.text());
  for (const auto& [from, errors] : by_distance) fmt::print("  {:2} to {:2} m:  {}\n", from, from + 5, errors.text());
  for (const auto& [name, errors] : by_kind)
    fmt::print("  {:20} {}  ({} not measured)\n", name, errors.text(), unmeasured[name]);
  fmt::print("within 3 stated sigma (plane): {:.1f} %; error over stated sigma {:.2f} rms\n",
             100.0 * static_cast<double>(within) / static_cast<double>(std::max<std::size_t>(all.count, 1)),
             std::sqrt(normalised / static_cast<double>(std::max<std::size_t>(all.count, 1))));
  fmt::print("not measured: {} of {} ({:.1f} %)\n", truth.size() - all.count, truth.size(),
             100.0 * static_cast<double>(truth.size() - all.count) / static_cast<double>(truth.size()));
  for (const auto& [why, count] : reasons) fmt::print("  {:4} {}\n", count, why);
  std::sort(worst.rbegin(), worst.rend());
  for (std::size_t i = 0; i < std::min<std::size_t>(worst.size(), 12); ++i)
    fmt::print("  farthest off: {}\n", worst[i].second);
  if (all.count == 0) return 1;
  return most > 0 && (all.plane_rms() > most || first13.plane_rms() > most) ? 1 : 0;
}

int run(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const std::vector<std::string> words(argv + std::min(argc, 2), argv + argc);
  try {
    if (what == "inputs") return inputs(words);
    if (what == "picks") return picks(words);
    if (what == "judge") return judge(words);
  } catch (const std::out_of_range&) {
    std::fprintf(stderr, "a word is missing\n");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  std::fprintf(stderr,
               "measuring_proof inputs SCENARIO OUT VIEWS POINTS [PANORAMA_WIDTH [LENSES]]\nmeasuring_proof picks "
               "SCENARIO SIM RIG OUT COUNT [PICK_PX [nearest|any [CLEAR_PX]]]\n"
               "measuring_proof judge MEASURED.csv TRUTH.csv [MOST_PLANE_RMS_M]\n");
  return 2;
}

}  // namespace
}  // namespace hueline::apps::test

int main(int argc, char** argv) {
  hueline::open_standard_streams();
  return hueline::apps::test::run(argc, argv);
}
