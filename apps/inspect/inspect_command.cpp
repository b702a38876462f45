#include <memory>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/inspect/inspect.hpp"
#include "apps/log.hpp"
#include "apps/office_program.hpp"

namespace hueline::apps {

void add_inspect(Command& all) {
  struct Options {
    std::string path, dbc;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  Command command = all.command(kInspect.word, kInspect.help);
  command.required("FILE", options->path, "a file of hueline or of a device, or a drive's folder");
  command.option("--dbc", options->dbc, "a DBC file: says what the signals in a log of a CAN bus were");
  command.flag("--json", options->json, "print JSON, for programs");
  command.footer(
      "Example: hueline inspect drives/today/drive.mcap\n"
      "Exit status: 0; 2 if a rig is wrong; 3 if the file is not known, or could be read only in part.\n"
      "More: docs/operating.md");
  command.runs([options] {
    const Inspection inspection = inspect_file(options->path, drivers::device_types(), options->dbc);
    if (!options->dbc.empty() && !inspection.takes_dbc && (inspection.found || inspection.may_be_scenario)) {
      log_error("--dbc: {} is no log of a CAN bus", options->path);
      return static_cast<int>(kWrongUse);
    }
    if (!inspection.may_be_scenario) return show(inspection, options->json);
    std::string hueline = "hueline", word = kInspect.word, json = "--json";
    std::vector<char*> words = {hueline.data(), word.data(), options->path.data()};
    if (options->json) words.push_back(json.data());
    words.push_back(nullptr);
    return run_office_program(words.data());
  });
}

}  // namespace hueline::apps
