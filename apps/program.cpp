#include "apps/program.hpp"

#include <csignal>
#include <cstdio>
#include <exception>
#include <string>

#include "apps/exit_code.hpp"
#include "apps/input_error.hpp"
#include "apps/log.hpp"
#include "config/section.hpp"
#include "core/printable.hpp"
#include "core/standard_streams.hpp"
#include "runtime/version.hpp"

namespace hueline::apps {
namespace {

constexpr const char* kFooter = R"(
A first drive, without any hardware:
  hueline simulate config/scenarios/street.yaml --out out/sim --play &   emulates the devices on real sockets
  hueline capture config/rigs/street.yaml --out out/drive                records and colours until Ctrl-C
  hueline replay out/drive/drive.mcap --out out/again                    makes the same bytes again
  hueline inspect out/drive/drive.mcap                                   shows what is in the recording

An input may be an object of a storage, s3://BUCKET/KEY: AWS_ACCESS_KEY_ID and the like say who asks, AWS_ENDPOINT_URL
which storage.

The folder of a drive holds drive.mcap (everything as received), cloud.las (coloured points), view.mcap (for Foxglove),
summary.json, and report.html and report.pdf with the verdict; with the rig's `cloud: {split: tile:100m}` also the
folder parts with strips or tiles of the cloud.

Exit status:
  0  the work is done
  1  any other error
  2  the command line is wrong, or a rig, a scenario or a sheet is wrong or missing
  3  any other input could not be read, or only in part
  4  an output could not be written
  5  no device sent anything, no point could be made, or a cloud has none
  6  verify, score or replay --expect found a figure out of its bound
  7  stopped before the end; fleet: drives are still open
  8  capture or replay: all is written, but the drive must be driven again
  9  check: not ready for a drive; doctor: something is left to set

Ctrl-C ends capture, replay and simulate; they finish the work on what has come. A second Ctrl-C ends them at once.)";

int tell(const std::exception& error, int status) {
  std::fprintf(stderr, "hueline: %s\n", printable(error.what(), LineEnds::Keep).c_str());
  return status;
}

int run(int argc, char** argv, const std::function<void(Command&)>& add_commands) {
  try {
    return run_command_line(
        argc, argv, "hueline: records a mobile mapping vehicle's sensors and colours its laser points while it drives.",
        std::string("hueline ") + runtime::kVersion + " (" + runtime::kGitRevision + ")", kFooter, add_commands);
  } catch (const config::ConfigError& e) {
    return tell(e, kWrongUse);
  } catch (const InputError& e) {
    return tell(e, kInputUnreadable);
  } catch (const std::exception& e) {
    return tell(e, kFailed);
  }
}

}  // namespace

int run_program(int argc, char** argv, const std::function<void(Command&)>& add_commands) {
  open_standard_streams();
  // A write into a file that has reached the limit of its size shall return an error instead of ending the program.
  std::signal(SIGXFSZ, SIG_IGN);
  // Log lines are for people and go to standard error. Standard output stays free for results that programs read.
  set_up_log();
  const int status = run(argc, argv, add_commands);
  const Status written = flush_standard_output();
  if (written.ok()) return status;
  log_error(written.error().message);
  return status == kDone ? kOutputRefused : status;
}

}  // namespace hueline::apps
