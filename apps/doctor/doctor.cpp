#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "config/rig.hpp"
#include "runtime/host_settings.hpp"

namespace hueline::apps {
namespace {

struct DoctorOptions {
  std::string rig, root = "/";
  bool fixes = false;
};

int doctor(const DoctorOptions& options) {
  std::optional<config::Rig> rig;
  if (!options.rig.empty()) rig = config::load_rig(options.rig);
  std::error_code unknown;
  if (!std::filesystem::is_directory(options.root, unknown)) {
    log_error("--root {}: there is no such folder", options.root);
    return kWrongUse;
  }
  const std::vector<runtime::HostSetting> unset = runtime::find_unset(options.root, rig ? &*rig : nullptr);
  int left = 0, refused = 0;
  for (const runtime::HostSetting& one : unset) {
    fmt::print("{}: {}\n  why: {}\n", one.name, one.found, one.why);
    if (one.file.empty()) {
      fmt::print("  do: {}\n", one.action);
      ++left;
      continue;
    }
    if (!options.fixes) {
      fmt::print("  do: write {} to {} (--fix does it); it lasts by {}\n", one.value, one.file.string(), one.action);
      ++left;
      continue;
    }
    if (const Status done = runtime::set(one); !done.ok()) {
      log_error("{}; {}", done.error().message,
                geteuid() == 0 ? "in a container, set it on the computer that runs the container" : "run it as root");
      ++refused;
      continue;
    }
    fmt::print("  set to {} until the next start of the computer; it lasts by {}\n", one.value, one.action);
  }
  // Not every container shows them.
  std::string unseen;
  for (const char* file :
       {"proc/sys/net/core/rmem_max", "sys/devices/system/clocksource/clocksource0/current_clocksource"})
    if (!std::filesystem::exists(std::filesystem::path(options.root) / file, unknown))
      unseen += fmt::format("{}/{}", unseen.empty() ? "" : ", ", file);
  if (unset.empty())
    fmt::print("the computer is set for a capture{}\n",
               unseen.empty() ? "" : ", as far as it can be seen: there is no " + unseen);
  if (refused > 0) return kOutputRefused;
  return left > 0 ? kNotReady : kDone;
}

}  // namespace

void add_doctor(Command& all) {
  auto options = std::make_shared<DoctorOptions>();
  Command command = all.command(
      "doctor", "find and explain the settings of this computer that disturb a capture, and set them if asked to");
  command.option("RIG", options->rig, "rig file (YAML), or the name of a shipped one, for what its devices need");
  command.flag("--fix", options->fixes, "set what can be set; this needs root");
  command.setting("--root", options->root, "look at the computer whose files are in this folder");
  command.footer(
      "`hueline check RIG` listens to the sensors and measures the disk; doctor looks at settings alone.\n"
      "Example: hueline doctor rig.yaml\n"
      "Exit status: 0 if nothing is left to set; 4 if a setting was refused; 9 if something is left.\n"
      "More: docs/operating.md");
  command.reads(options->rig);
  command.runs([options] { return doctor(*options); });
}

}  // namespace hueline::apps
