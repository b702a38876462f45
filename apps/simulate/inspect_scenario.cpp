#include "apps/commands.hpp"
#include "apps/inspect/inspect.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"

namespace hueline::apps {
namespace {

Inspection inspect_scenario(const std::string& path) {
  try {
    const sim::Scenario scenario = config::load_scenario(path);
    return {std::make_unique<nlohmann::ordered_json>(nlohmann::ordered_json{{"format", "scenario"},
                                                                            {"duration_s", scenario.duration_s},
                                                                            {"seed", scenario.seed},
                                                                            {"fingerprint", scenario.fingerprint()}}),
            {}};
  } catch (const config::ConfigError& e) {
    return {nullptr, Error{ErrorCode::Invalid, e.what()}};
  }
}

}  // namespace

void add_inspect_scenario(Command& all) {
  struct Options {
    std::string path;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  Command command = all.command(kInspect.word, "print what a simulator's scenario contains");
  command.required("FILE", options->path, "scenario (YAML)");
  command.flag("--json", options->json, "print JSON, for programs");
  command.runs([options] { return show(inspect_scenario(options->path), options->json); });
}

}  // namespace hueline::apps
