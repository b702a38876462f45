#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <exception>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/version.hpp"
#include "config/section.hpp"

namespace {

constexpr const char* kFooter = R"(
A first drive, without any hardware:
  hueline simulate config/scenarios/street.yaml --out out/sim --play &   emulated devices on real sockets
  hueline capture config/rigs/street.yaml --out out/drive                records and colours until they end or Ctrl-C
  hueline replay out/drive/drive.mcap --out out/again                    the same bytes again
  hueline inspect out/drive/drive.mcap                                   what is in it

A drive's folder holds drive.mcap (raw, everything as received), cloud.las (coloured), view.mcap (for Foxglove) and summary.json.

Exit status: 0 done; 2 wrong command line or configuration; 3 an input could not be read whole; 4 an output could not be
written; 5 nothing came; 6 verify or score found a figure out of its bound; 1 anything else.)";

}  // namespace

int main(int argc, char** argv) {
  using namespace hueline;
  // People read the terminal, programs read the files: log lines go to standard error.
  spdlog::set_default_logger(spdlog::stderr_color_mt("hueline"));
  spdlog::set_pattern("%H:%M:%S %^%l%$ %v");
  CLI::App app{"hueline: records a mobile mapping vehicle's sensors and colours its laser points while it drives."};
  app.footer(kFooter);
  app.set_version_flag("--version", std::string("hueline ") + apps::kVersion + " (" + apps::kGitRevision + ")");
  app.require_subcommand(1);
  apps::Chosen chosen;
  apps::add_capture(app, chosen);
  apps::add_replay(app, chosen);
  apps::add_simulate(app, chosen);
  apps::add_verify(app, chosen);
  apps::add_score(app, chosen);
  apps::add_colour(app, chosen);
  apps::add_inspect(app, chosen);
  apps::add_picture(app, chosen);
  try {
    app.parse(argc, argv);
    return chosen();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? apps::kDone : apps::kWrongUse;
  } catch (const config::ConfigError& e) {
    std::fprintf(stderr, "hueline: %s\n", e.what());
    return apps::kWrongUse;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "hueline: %s\n", e.what());
    return apps::kFailed;
  }
}
