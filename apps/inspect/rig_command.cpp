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
  Command rig = all.command("rig", "look at a rig file, and at what it may hold");
  rig.needs_command();
  Command show = rig.command("show", "draw the rig: sensors, axes, lever arms");
  show.required("RIG", options->rig, "rig file (YAML)");
  show.required("--out", options->out, "picture to write (SVG)");
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
  rig.command("schema", "print a JSON schema of rig files, for editors that complete and check YAML with it").runs([] {
    std::fputs((config::rig_schema().dump(2) + "\n").c_str(), stdout);
    return kDone;
  });
}

}  // namespace hueline::apps
