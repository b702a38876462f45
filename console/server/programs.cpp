#include "console/server/programs.hpp"

#include <fmt/format.h>

#include <system_error>
#include <vector>

namespace hueline::console {
namespace {

const std::vector<std::string> kSimulatedPorts = {"--data-port", "42368",    "--position-port", "48308",
                                                  "--pos-port",  "43001",    "--can-port",      "40000",
                                                  "--address",   "127.0.0.2"};

}  // namespace

std::filesystem::path Programs::work(const std::string& file) const {
  const std::filesystem::path folder = places_.drives / ".console";
  std::error_code ignored;  // shows when the file is written
  std::filesystem::create_directories(folder, ignored);
  return folder / file;
}

Result<Child> Programs::check(const std::string& rig_file, double seconds) const {
  return Child::start({places_.hueline, "check", rig_file, "--json", "--disk", places_.drives, "--seconds",
                       fmt::format("{:.1f}", seconds), "--hours", fmt::format("{:.1f}", places_.check_hours)},
                      work("check.log"), work("check.json"));
}

/// Starts `hueline simulate`: in both runs with the same folder and ports.
Result<Child> Programs::simulate(const std::string& scenario, const std::vector<std::string>& how,
                                 const char* log) const {
  std::vector<std::string> words{
      places_.hueline, "simulate",      places_.scenarios / (scenario + ".yaml"), "--out", work("sim-" + scenario),
      "--pps-socket",  work("pps.sock")};
  words.insert(words.end(), how.begin(), how.end());
  words.insert(words.end(), kSimulatedPorts.begin(), kSimulatedPorts.end());
  return Child::start(words, work(log));
}

Result<Child> Programs::render(const std::string& scenario) const {
  return simulate(scenario, {"--write-rig", rig_of(scenario)}, "simulate.log");
}

Result<Child> Programs::emulate(const std::string& scenario) const {
  return simulate(scenario, {"--play"}, "devices.log");
}

Result<Child> Programs::capture(const std::string& rig_file, const std::string& drive, bool is_emulated) const {
  std::vector<std::string> words{places_.hueline, "capture", rig_file, "--out", places_.drives / drive, "--quiet"};
  if (is_emulated) words.emplace_back("--until-silent");
  return Child::start(words, work("capture.log"));
}

Result<Child> Programs::replay(const std::filesystem::path& recording, const std::string& drive, double speed,
                               double from_s) const {
  std::error_code ignored;
  std::filesystem::remove_all(replays(), ignored);
  return Child::start({places_.hueline, "replay", recording, "--out", replays() / drive, "--speed",
                       fmt::format("{:.3f}", speed), "--from", fmt::format("{:.3f}", from_s)},
                      work("capture.log"));
}

}  // namespace hueline::console
