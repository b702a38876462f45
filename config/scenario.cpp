#include "config/scenario.hpp"

#include <filesystem>
#include <initializer_list>
#include <type_traits>

#include "config/section.hpp"
#include "config/shipped.hpp"

namespace hueline::config {
namespace {

/// Walks a Config's own list of keys (its visit()) beside a YAML mapping.
struct Reader {
  Section& section;

  void operator()(const char* key, bool& value) { value = section.boolean(key, value); }
  template <class T>
    requires std::is_arithmetic_v<T>
  void operator()(const char* key, T& value, double min, double max) {
    if constexpr (std::is_integral_v<T>)
      value = static_cast<T>(section.integer(key, {min, max}, static_cast<std::int64_t>(value)));
    else
      value = section.number(key, {min, max}, value);
  }
  template <class T>
  void operator()(const char* key, T& value, std::initializer_list<std::pair<const char*, T>> words) {
    std::vector<std::pair<std::string, T>> allowed;
    for (const auto& [word, meaning] : words) allowed.emplace_back(word, meaning);
    value = section.choice<T>(key, allowed, value);
  }
  template <class T>
  void operator()(const char* key, std::vector<T>& list) {
    if (!section.has(key)) return;
    list.clear();
    for (Section& one : section.list(key)) {
      T value{};
      T::visit(value, Reader{one});
      one.finish();
      list.push_back(value);
    }
  }
  template <class T>
    requires std::is_class_v<T>
  void operator()(const char* key, T& nested) {
    if (!section.has(key)) return;
    Section inside = section.section(key);
    T::visit(nested, Reader{inside});
    inside.finish();
  }
};

sim::FaultLine read_fault(Section& section) {
  std::vector<std::pair<std::string, sim::FaultType>> names;
  for (const sim::FaultEntry& entry : sim::fault_registry()) names.emplace_back(entry.name, entry.type);
  const sim::FaultEntry& entry = sim::entry_of(section.choice<sim::FaultType>("fault", names));
  sim::FaultLine line = sim::FaultLine::usual(entry.type, section.number("at_s", {0, 1e6}), 1);
  line.for_s = section.number("for_s", {1e-6, sim::kLongestFault_s}, line.for_s);
  if (entry.unit)
    line.strength = section.number("strength", {entry.least, entry.most}, line.strength);
  else if (section.has("strength"))
    section.refuse("strength", std::string(entry.name) + " has no strength");
  std::vector<std::pair<std::string, sim::FaultTarget>> targets;
  for (const sim::FaultTarget target : entry.targets) targets.emplace_back(sim::name(target), target);
  line.target = section.choice<sim::FaultTarget>("target", targets, line.target);
  section.finish();
  return line;
}

/// `image` is relative to the scenario's file.
std::shared_ptr<const sim::Surroundings> read_surroundings(Section section, const std::string& name) {
  const auto image = std::filesystem::path(name).parent_path() / section.text("image");
  const auto loaded = sim::Surroundings::load(image, section.number("centre_azimuth_deg", {0, 360}, 0));
  if (!loaded.ok()) section.refuse("image", loaded.error().message);
  section.finish();
  return *loaded;
}

sim::Scenario read(Section root, const std::string& name) {
  sim::Scenario scenario;
  sim::Scenario::visit(scenario, Reader{root});
  if (root.has("surroundings")) scenario.surroundings = read_surroundings(root.section("surroundings"), name);
  for (Section& one : root.list_or_empty("faults")) scenario.faults.push_back(read_fault(one));
  root.finish();
  if (const std::string wrong = scenario.validate(); !wrong.empty()) throw ConfigError(name + ": " + wrong);
  return scenario;
}

}  // namespace

sim::Scenario load_scenario(const std::string& path) {
  const std::string named = configuration_named(path, "scenarios");
  return read(Section::load_file(named), named);
}
sim::Scenario parse_scenario(const std::string& text, const std::string& name) { return read(Section::load_text(text, name), name); }

}  // namespace hueline::config
