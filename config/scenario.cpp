#include "config/scenario.hpp"

#include <filesystem>
#include <utility>
#include <vector>

#include "config/key_reader.hpp"
#include "config/shipped.hpp"

namespace hueline::config {
namespace {

/// The keys of one fault. Its name decides whether it has a strength, in which range, and which devices it can affect.
struct FaultKeys {
  sim::FaultLine line;

  void visit(Keys& keys) {
    KeyKinds names;
    names.has_tables = true;
    for (const sim::FaultEntry& entry : sim::fault_registry()) names.words.emplace_back(entry.name);
    names.make = [this](std::size_t word) {
      const sim::FaultEntry& entry = sim::fault_registry()[word];
      line = sim::FaultLine::usual(entry.type, 0, 1);
      return KeyGroup{[this, &entry](Keys& inside) { visit_fault(inside, entry); }, [] { return KeyError(); }};
    };
    keys.kinds(required("fault", "", "What happens: one of the names below."), names);
  }

 private:
  void visit_fault(Keys& keys, const sim::FaultEntry& entry) {
    keys.number(required("at_s", "s", "When it begins, after the drive's beginning, lead-in included."), line.at_s,
                {0, 1e6});
    keys.number({"for_s", "s", "How long it lasts."}, line.for_s, {1e-6, sim::kLongestFault_s});
    if (entry.unit)
      keys.number({"strength", entry.unit, "S in the table below. A fault without a unit has none.", "see below"},
                  line.strength, {entry.least, entry.most});
    std::vector<std::string> words;
    std::optional<std::size_t> chosen;
    for (const sim::FaultTarget target : entry.targets) {
      if (target == line.target) chosen = words.size();
      words.emplace_back(sim::name(target));
    }
    if (keys.choice({"target", "", "The device that it happens to.", "the first below"}, chosen, words))
      line.target = entry.targets.begin()[*chosen];
  }
};

struct SurroundingsKeys {
  std::string image;
  double centre_azimuth_deg = 0;

  void visit(Keys& keys) {
    keys.text(required("image", "",
                       "A photograph all around (JPEG), infinitely far away, instead of the painted sky: what no laser "
                       "reaches and every camera sees. Equirectangular, twice as "
                       "wide as high, zenith on top; relative to the scenario's file. It does not light the scene; "
                       "`street.sky_brightness` times its white."),
              image);
    keys.number({"centre_azimuth_deg", "deg", "The azimuth of the photograph's middle column, clockwise from north."},
                centre_azimuth_deg, {0, 360});
  }
};

struct ScenarioKeys {
  sim::Scenario scenario{};
  std::optional<SurroundingsKeys> surroundings{};
  std::vector<FaultKeys> faults{};

  void visit(Keys& keys) {
    scenario.visit(keys);
    keys.section({"surroundings", "", "A photograph instead of the painted sky.", "none"}, surroundings);
    keys.list({"faults", "", "What spoils the drive.", "none"}, faults);
  }
  /// `name` is the file of the scenario. The path of the photograph is relative to it.
  KeyError complete(const std::string& name) {
    for (const FaultKeys& fault : faults) scenario.faults.push_back(fault.line);
    if (surroundings) {
      const auto loaded = sim::Surroundings::load(std::filesystem::path(name).parent_path() / surroundings->image,
                                                  surroundings->centre_azimuth_deg);
      if (!loaded.ok()) return {"surroundings.image", "cannot be read: " + loaded.error().message};
      scenario.surroundings = *loaded;
    }
    return scenario.validate();
  }
};

sim::Scenario read(Section root, const std::string& name) {
  ScenarioKeys keys;
  read_keys(root, {[&](Keys& reader) { keys.visit(reader); },
                   [&] {
                     root.finish();
                     return keys.complete(name);
                   }});
  return std::move(keys.scenario);
}

}  // namespace

KeyDocument scenario_document() {
  return {"scenario", [](Keys& keys) { ScenarioKeys().visit(keys); }, true};
}

sim::Scenario load_scenario(const std::string& path) {
  const std::string named = configuration_named(path, "scenarios");
  return read(Section::load_file(named), named);
}
sim::Scenario parse_scenario(const std::string& text, const std::string& name) {
  return read(Section::load_text(text, name), name);
}

}  // namespace hueline::config
