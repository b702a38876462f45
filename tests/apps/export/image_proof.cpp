// A simulated drive as a recording, and what its lenses truly saw: the inputs of image_export_test.py.
//
//   image_proof SCENARIO SIM OUT [PLACES]
//     writes OUT/drive.mcap and OUT/sights.csv: time of an exposure, lens, pixel, and the ECEF place that the pixel
//     shows, from the simulator's own geometry. For each line of PLACES (time of an exposure, lens, ECEF place) a line
//     in OUT/answers.csv: how far the place is from the lens, at what distance the lens sees something in that
//     direction (0: nothing), and the place's pixel
#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "core/standard_streams.hpp"
#include "runtime/recording.hpp"
#include "sim/earth.hpp"
#include "sim/generate.hpp"
#include "sim/ins_model.hpp"
#include "sim/rig_truth.hpp"
#include "sim/truth_file.hpp"
#include "sim/vehicle.hpp"
#include "sim/wire/timeline.hpp"
#include "sim/world.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::apps::test {
namespace {

Status record(const sim::Scenario& scenario, const sim::Drive& drive, const std::string& path) {
  const auto rig = config::parse_rig(simulated_rig(scenario, {}, "lens"), "rig");
  sim::TimelineConfig config;
  config.laser_model = scenario.laser.model;
  const auto timeline = sim::build_timeline(drive, config);
  if (!timeline.ok()) return timeline.error();
  storage::JournalWriter::Config writing;
  writing.if_exists = IfExists::Replace;
  auto journal = storage::JournalWriter::create(path, runtime::journal_header(rig), writing);
  if (!journal.ok()) return journal.error();
  std::uint64_t sequence = 0;
  Status written;
  const Status made = for_each_simulated_packet(drive, *timeline, rig, [&](const Packet& packet) {
    Packet numbered = packet;
    numbered.sequence = sequence++;
    written = journal->append(numbered, nanoseconds(0));
    return written.ok();
  });
  const Status closed = journal->close();
  return !made.ok() ? made : !written.ok() ? written : closed;
}

/// The world of a scenario, and its level in ECEF.
struct Truth {
  explicit Truth(const sim::Scenario& scenario)
      : motion(scenario),
        world(scenario, motion),
        rig(sim::rig_truth(scenario)),
        origin(sim::ecef_from_geodetic(sim::scene_origin(scenario))),
        R_ecef_enu(sim::R_ecef_enu(sim::scene_origin(scenario))) {}
  sim::Motion motion;
  sim::World world;
  sim::RigTruth rig;
  sim::Vec3 origin;
  sim::Mat3 R_ecef_enu;
};

void write_sights(const sim::Scenario& scenario, const sim::TruthReader& truth, const std::string& path) {
  const Truth truth_of(scenario);
  const auto& [motion, world, rig, origin, R] = truth_of;
  std::ofstream out(path);
  out << "gps_s,lens,u,v,x,y,z\n";
  for (const auto& exposure : truth.header().exposures) {
    const sim::Moment moment = world.moment(exposure.exposure_mid_gps_ns);
    for (std::size_t lens = 0; lens < rig.lenses.size(); ++lens) {
      const sim::Pose T_enu_lens = moment.T_enu_body * rig.T_body_head * rig.lenses[lens].T_head_lens;
      for (int v = 3; v < rig.lenses[lens].height; v += 23)
        for (int u = 3; u < rig.lenses[lens].width; u += 25) {
          const auto direction = rig.lenses[lens].ray(u, v);
          if (!direction) continue;
          const sim::World::Ray ray{T_enu_lens.p, T_enu_lens.R * *direction};
          sim::Seen seen;
          world.look(moment, std::span(&ray, 1), 1e-4f, std::span(&seen, 1));
          if (!seen.is_hit || seen.surface == 1) continue;
          const sim::Vec3 place = origin + R * (ray.origin + seen.distance_m * ray.direction);
          out << fmt::format("{:.9f},{},{},{},{:.5f},{:.5f},{:.5f}\n",
                             static_cast<double>(exposure.exposure_mid_gps_ns) * 1e-9, lens, u, v, place.x, place.y,
                             place.z);
        }
    }
  }
}

void answer(const sim::Scenario& scenario, const std::string& places, const std::string& path) {
  const Truth truth_of(scenario);
  const auto& [motion, world, rig, origin, R] = truth_of;
  std::ifstream in(places);
  std::ofstream out(path);
  out << "distance_m,seen_m,u,v\n";
  std::int64_t gps_ns = 0;
  std::size_t lens = 0;
  sim::Vec3 place;
  sim::Moment moment = world.moment(0);
  while (in >> gps_ns >> lens >> place.x >> place.y >> place.z) {
    if (gps_ns != moment.gps_ns) moment = world.moment(gps_ns);
    const sim::Pose T_enu_lens = moment.T_enu_body * rig.T_body_head * rig.lenses.at(lens).T_head_lens;
    const sim::Vec3 away = transposed(R) * (place - origin) - T_enu_lens.p;
    const double distance = length(away);
    const sim::World::Ray ray{T_enu_lens.p, (1 / distance) * away};
    sim::Seen seen;
    world.look(moment, std::span(&ray, 1), 1e-4f, std::span(&seen, 1));
    const auto pixel =
        rig.lenses[lens].project(transposed(T_enu_lens.R) * ray.direction).value_or(sim::TruePixel{-1, -1});
    out << fmt::format("{:.4f},{:.4f},{:.4f},{:.4f}\n", distance, seen.is_hit ? seen.distance_m : 0.0, pixel.u,
                       pixel.v);
  }
}

int prove(const std::vector<std::string>& words) {
  const sim::Scenario scenario = config::load_scenario(words[0]);
  if (words.size() == 4) return answer(scenario, words[3], words[2] + "/answers.csv"), 0;
  const auto drive = sim::generate(scenario, words[1]);
  if (!drive.ok()) return std::fprintf(stderr, "%s\n", drive.error().message.c_str()), 1;
  const auto truth = sim::TruthReader::open(drive->cache_dir + "/truth.bin");
  if (!truth.ok()) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 1;
  if (const Status made = record(scenario, *drive, words[2] + "/drive.mcap"); !made.ok())
    return std::fprintf(stderr, "%s\n", made.error().message.c_str()), 1;
  write_sights(scenario, *truth, words[2] + "/sights.csv");
  return 0;
}

}  // namespace
}  // namespace hueline::apps::test

int main(int argc, char** argv) {
  hueline::open_standard_streams();
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() != 3 && words.size() != 4)
    return std::fprintf(stderr, "usage: image_proof SCENARIO SIM OUT [PLACES]\n"), 2;
  try {
    return hueline::apps::test::prove(words);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "image_proof: %s\n", error.what()), 1;
  }
}
