#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "config/key_documents.hpp"
#include "config/rig_picture.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {

void add_rig(Command& all) {
  struct Options {
    std::string rig, out;
  };
  auto options = std::make_shared<Options>();
  Command rig = all.command("rig", "draw a rig file, or print the schema of rig files");
  rig.needs_command();
  Command show = rig.command("show", "draw a rig with its sensors, axes and lever arms");
  show.required("RIG", options->rig, "rig file (YAML), or the name of a rig that comes with the program");
  show.required("--out", options->out, "SVG file to write");
  show.footer(
      "Example: hueline rig show street --out street.svg\n"
      "Exit status: 0; 2 if the rig is wrong.\n"
      "More: docs/rig.md");
  show.reads(options->rig).writes(options->out);
  show.runs([options] {
    if (!options->out.ends_with(".svg"))
      throw config::ConfigError(options->out + ": the picture is written as SVG; give a name that ends in .svg");
    if (const Status written = write_output(options->out, config::rig_svg(config::load_rig(options->rig)));
        !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
    return kDone;
  });
  Command schema =
      rig.command("schema", "print the JSON schema of rig files, with which editors complete and check YAML");
  schema.footer(
      "Example: hueline rig schema\n"
      "Exit status: 0.\n"
      "More: docs/rig.md");
  schema.runs([] {
    std::fputs((config::rig_schema().dump(2) + "\n").c_str(), stdout);
    return kDone;
  });
}

}  // namespace hueline::apps
