// The users' documents against the readers of the files they describe: examples load, and no key is missing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <initializer_list>
#include <sstream>

#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::config {
namespace {

std::string document(const char* name) {
  std::ifstream in(test::source_dir() / "docs" / name, std::ios::binary);
  EXPECT_TRUE(in) << name;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// What stands between "```yaml" and "```".
std::vector<std::string> examples(const std::string& text) {
  const std::string begin = "```yaml\n", end = "```";
  std::vector<std::string> out;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at)) {
    at += begin.size();
    const std::size_t stop = text.find(end, at);
    out.push_back(text.substr(at, stop - at));
    at = stop;
  }
  return out;
}

/// The keys that a reader knows in one mapping of `root`: it says so when it meets one that it does not know.
void collect_known(const YAML::Node& root, YAML::Node at, std::set<std::string>& keys) {
  if (at.IsMap()) {
    at["no_such_key"] = 1;
    try {
      parse_rig(YAML::Dump(root), "example");
      ADD_FAILURE() << "an unknown key was taken";
    } catch (const ConfigError& e) {
      const std::string said = e.what(), lead = "known here: ";
      const std::size_t from = said.find(lead);
      ASSERT_NE(from, std::string::npos) << said;
      std::istringstream list(said.substr(from + lead.size()));
      for (std::string key; std::getline(list >> std::ws, key, ',');) keys.insert(key);
    }
    at.remove("no_such_key");
    for (const auto& item : at) collect_known(root, item.second, keys);
  } else if (at.IsSequence()) {
    for (const auto& item : at) collect_known(root, item, keys);
  }
}

TEST(RigDocument, EveryExampleLoads) {
  const auto found = examples(document("rig.md"));
  EXPECT_GE(found.size(), 5u);
  for (const std::string& text : found) EXPECT_NO_THROW(parse_rig(text, "docs/rig.md")) << text;
}

TEST(RigDocument, NamesEveryKeyThatTheReaderKnows) {
  const std::string text = document("rig.md");
  std::set<std::string> keys;
  for (const std::string& example : examples(text)) {
    const YAML::Node root = YAML::Load(example);
    collect_known(root, root, keys);
  }
  EXPECT_GE(keys.size(), 90u) << "the examples no longer reach every reader";
  for (const std::string& key : keys) EXPECT_NE(text.find('`' + key + '`'), std::string::npos) << key << " is not described";
}

/// The first cells of a row of docs/scenario.md, for each key of a scenario.
struct Rows {
  std::vector<std::string>& out;
  std::string path;

  static std::string number(double v) { return fmt::format("{:.10g}", v); }
  void add(const char* key, const std::string& value, const std::string& allowed) {
    out.push_back(fmt::format("| `{}{}` | {} | {} |", path, key, value, allowed));
  }
  void operator()(const char* key, bool value) { add(key, value ? "true" : "false", "true, false"); }
  template <class T>
    requires std::is_arithmetic_v<T>
  void operator()(const char* key, T value, double min, double max) {
    add(key, number(static_cast<double>(value)), number(min) + " .. " + number(max));
  }
  template <class T>
  void operator()(const char* key, T value, std::initializer_list<std::pair<const char*, T>> words) {
    std::string chosen, allowed;
    for (const auto& [word, meaning] : words) {
      if (meaning == value) chosen = word;
      allowed += (allowed.empty() ? "" : ", ") + std::string(word);
    }
    add(key, chosen, allowed);
  }
  template <class T>
  void operator()(const char* key, const std::vector<T>&) {
    const T one{};
    T::visit(one, Rows{out, path + key + "[]."});
  }
  template <class T>
    requires std::is_class_v<T>
  void operator()(const char* key, const T& section) {
    T::visit(section, Rows{out, path + key + "."});
  }
};

TEST(ScenarioDocument, HasEveryKeyWithItsDefaultAndRange) {
  const std::string text = document("scenario.md");
  const sim::Scenario scenario;
  std::vector<std::string> rows;
  sim::Scenario::visit(scenario, Rows{rows, ""});
  EXPECT_GE(rows.size(), 80u);
  for (const std::string& row : rows) EXPECT_NE(text.find(row), std::string::npos) << row;
}

TEST(ScenarioDocument, EveryExampleLoads) {
  const auto found = examples(document("scenario.md"));
  EXPECT_GE(found.size(), 1u);
  for (const std::string& text : found) EXPECT_NO_THROW(parse_scenario(text, "docs/scenario.md")) << text;
}

}  // namespace
}  // namespace hueline::config
