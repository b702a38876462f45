#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "config/key_documents.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {

void add_keys(Command& all) {
  auto document = std::make_shared<std::string>();
  Command keys = all.command(kKeys.word, kKeys.help);
  keys.required("FILE", *document, "Markdown, such as docs/rig.md or docs/scenario.md");
  keys.writes(*document);
  keys.footer(
      "Example: hueline keys docs/rig.md\n"
      "Exit status: 0; 2 if the document cannot be read, or a table in it is not ended.\n"
      "More: docs/rig.md");
  keys.runs([document] {
    const std::string text = config::with_key_tables(config::read_configuration(*document),
                                                     {config::rig_document(), config::scenario_document()});
    if (const Status written = write_output(*document, text); !written.ok()) {
      log_error(written.error().message);
      return kOutputRefused;
    }
    return kDone;
  });
}

}  // namespace hueline::apps
