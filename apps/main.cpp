#include <cstdio>
#include <exception>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "runtime/version.hpp"
#include "config/section.hpp"
#include "core/printable.hpp"
#include "core/standard_streams.hpp"

namespace {

constexpr const char* kFooter = R"(
A first drive, without any hardware:
  hueline simulate config/scenarios/street.yaml --out out/sim --play &   emulated devices on real sockets
  hueline capture config/rigs/street.yaml --out out/drive                records and colours until they end or Ctrl-C
  hueline replay out/drive/drive.mcap --out out/again                    the same bytes again
  hueline inspect out/drive/drive.mcap                                   what is in it

A drive's folder holds drive.mcap (raw, everything as received), cloud.las (coloured), view.mcap (for Foxglove) and summary.json.

Exit status: 0 done; 2 wrong command line or configuration; 3 an input could not be read whole; 4 an output could not be
written; 5 nothing came; 6 verify or score found a figure out of its bound; 7 stopped before it was done; 1 anything else.

Ctrl-C ends capture, replay and simulate with what has come; a second one ends them at once.)";

int run(int argc, char** argv) {
  using namespace hueline;
  try {
    return apps::run_command_line(argc, argv, "hueline: records a mobile mapping vehicle's sensors and colours its laser points while it drives.",
                                  std::string("hueline ") + runtime::kVersion + " (" + runtime::kGitRevision + ")", kFooter, [](apps::Command& all) {
                                    apps::add_capture(all);
                                    apps::add_replay(all);
                                    apps::add_simulate(all);
                                    apps::add_verify(all);
                                    apps::add_score(all);
                                    apps::add_colour(all);
                                    apps::add_calibrate(all);
                                    apps::add_measure(all);
                                    apps::add_rig(all);
                                    apps::add_inspect(all);
                                    apps::add_picture(all);
                                  });
  } catch (const config::ConfigError& e) {
    std::fprintf(stderr, "hueline: %s\n", printable(e.what(), LineEnds::Keep).c_str());
    return apps::kWrongUse;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "hueline: %s\n", printable(e.what(), LineEnds::Keep).c_str());
    return apps::kFailed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  hueline::open_standard_streams();
  // People read the terminal, programs read the files: log lines go to standard error.
  hueline::apps::set_up_log();
  const int status = run(argc, argv);
  const hueline::Status written = hueline::flush_standard_output();
  if (written.ok()) return status;
  hueline::apps::log_error(written.error().message);
  return status == hueline::apps::kDone ? hueline::apps::kOutputRefused : status;
}
