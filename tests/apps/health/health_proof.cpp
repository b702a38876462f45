// Drives flawless simulated drives again and again, each time with other noise of the devices and of their deliveries,
// and prints whatever health warns of: there must be nothing. Usage: health_proof CACHE SEEDS SCENARIO...
#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "apps/simulate/simulated_recording.hpp"
#include "apps/simulate/simulated_rig.hpp"
#include "config/scenario.hpp"
#include "runtime/pipeline.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"

namespace hueline {
namespace {

class Listener : public runtime::ProductSink {
 public:
  Listener(std::string drive, std::vector<std::string> names) : drive_(std::move(drive)), names_(std::move(names)) {}
  void on_health(const runtime::HealthChange& change) override {
    is_ready_ |= change.sensor == kSystemSensor && !change.trouble;
    if (change.level < runtime::HealthLevel::Warning) return;
    ++warnings_;
    fmt::print("{} {:.1f} s {}: {}\n", drive_, change.drive_s, names_.at(change.sensor), text(change));
  }
  int warnings() const { return warnings_; }
  bool is_ready() const { return is_ready_; }

 private:
  const std::string drive_;
  const std::vector<std::string> names_;
  int warnings_ = 0;
  bool is_ready_ = false;
};

int run(int argc, char** argv) {
  if (argc < 4) return 2;
  const int seeds = std::atoi(argv[2]);
  double hours = 0;
  int warnings = 0, not_ready = 0, drives = 0;
  for (int i = 3; i < argc; ++i) {
    sim::Scenario scenario = config::load_scenario(argv[i]);
    scenario.faults.clear();
    const auto drive = sim::generate(scenario, argv[1]);
    if (!drive.ok()) {
      fmt::print("{}: {}\n", argv[i], drive.error().message);
      return 1;
    }
    const config::Rig rig = config::parse_rig(apps::simulated_rig(scenario, {}, "lens"), "simulated rig");
    for (int seed = 0; seed < seeds; ++seed) {
      sim::TimelineConfig config;
      config.seed = scenario.seed + static_cast<std::uint64_t>(seed);
      config.laser_model = scenario.laser.model;
      const auto timeline = sim::build_faulty_timeline(*drive, config, {});
      if (!timeline.ok()) return 1;
      Listener listener(fmt::format("{} seed {}", argv[i], config.seed), rig.sensor_names());
      runtime::Pipeline pipeline(rig, 1, listener);
      const Status fed = apps::for_each_simulated_packet(*drive, timeline->timeline, rig, [&](const Packet& packet) {
        pipeline.process(packet);
        return true;
      });
      if (!fed.ok()) return 1;
      pipeline.flush();
      hours += pipeline.health().drive_s() / 3600;
      warnings += listener.warnings();
      not_ready += listener.is_ready() ? 0 : 1;
      ++drives;
    }
    fmt::print("{}: so far {} drives, {:.3f} h, {} warnings or alarms, {} drives never ready\n", argv[i], drives, hours,
               warnings, not_ready);
    std::fflush(stdout);
  }
  return warnings == 0 && not_ready == 0 ? 0 : 1;
}

}  // namespace
}  // namespace hueline

int main(int argc, char** argv) { return hueline::run(argc, argv); }
