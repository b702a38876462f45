// Checks the users' documents against the readers of the files that they describe: every example loads, and no key is
// missing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "config/key_documents.hpp"
#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "config/section.hpp"
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

/// Returns the texts between "```yaml" and "```".
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

/// Collects the keys that a reader knows in one mapping of `root`. It finds them in the error that the reader gives for
/// an unknown key.
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
  for (const std::string& key : keys)
    EXPECT_NE(text.find('`' + key + '`'), std::string::npos) << key << " is not described";
}

const std::vector<KeyDocument> kLists{rig_document(), scenario_document()};

TEST(Documents, HaveTheTablesOfTheKeysAsTheyAreDeclared) {
  for (const char* name : {"rig.md", "scenario.md"})
    EXPECT_EQ(document(name), with_key_tables(document(name), kLists))
        << "write the tables anew: hueline keys docs/" << name;
}

TEST(Documents, RefuseAMarkerThatNamesNothing) {
  EXPECT_THROW(with_key_tables("<!-- keys rig sensers -->\n<!-- end of keys -->\n", kLists), ConfigError);
  EXPECT_THROW(with_key_tables("<!-- keys rig -->\n", kLists), ConfigError);
  EXPECT_NE(with_key_tables("a\n<!-- keys rig sensors velodyne -->\nold\n<!-- end of keys -->\nb\n", kLists)
                .find("| `min_range_m` | m | 0.5 | 0 .. 131 | Nearer returns are dropped. |"),
            std::string::npos);
}

TEST(Scenario, SurroundingsThatCannotBeReadAreRefusedWithTheirPlace) {
  const auto complaint = [](const std::string& text) {
    try {
      (void)parse_scenario(text, "folder/s.yaml");
    } catch (const ConfigError& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  const std::string missing = complaint("seed: 2\nsurroundings: {image: none.jpg}");
  EXPECT_NE(missing.find("s.yaml:2"), std::string::npos) << missing;
  EXPECT_NE(missing.find("surroundings.image"), std::string::npos) << missing;
  EXPECT_NE(missing.find("folder/none.jpg"), std::string::npos) << missing << ": relative to the scenario's file";
  EXPECT_NE(complaint("surroundings: {centre_azimuth_deg: 3}").find("image"), std::string::npos);
  EXPECT_NE(complaint("surroundings: {image: none.jpg, turned: 3}"), "taken");
}

TEST(ScenarioDocument, HasEveryFaultAsTheRegistryHasIt) {
  const std::string text = document("scenario.md");
  for (const sim::FaultEntry& entry : sim::fault_registry()) {
    std::string targets;
    for (const sim::FaultTarget target : entry.targets)
      targets += (targets.empty() ? "" : ", ") + std::string(sim::name(target));
    const std::string row = entry.unit
                                ? fmt::format("| `{}` | {} | {:.10g} | {:.10g} .. {:.10g} | {} | {} |", entry.name,
                                              targets, entry.usual, entry.least, entry.most, entry.unit, entry.what)
                                : fmt::format("| `{}` | {} |  |  |  | {} |", entry.name, targets, entry.what);
    EXPECT_NE(text.find(row), std::string::npos) << row;
  }
}

TEST(Scenario, FaultsAreReadStrictly) {
  const auto faults = [](const std::string& line) {
    return parse_scenario("seed: 2\nfaults:\n  - " + line, "s.yaml").faults.at(0);
  };
  const sim::FaultLine line = faults("{fault: packet_loss, at_s: 3, for_s: 2.5, strength: 0.2, target: pos}");
  EXPECT_EQ(line.type, sim::FaultType::PacketLoss);
  EXPECT_EQ(line.begin_ns(), 3'000'000'000);
  EXPECT_EQ(line.end_ns(), 5'500'000'000);
  EXPECT_EQ(line.strength, 0.2);
  EXPECT_EQ(line.target, sim::FaultTarget::Pos);
  EXPECT_EQ(faults("{fault: pps_shift, at_s: 3}").strength, sim::entry_of(sim::FaultType::PpsShift).usual);
  const auto complaint = [&](const std::string& text) {
    try {
      faults(text);
    } catch (const ConfigError& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  const std::string typo = complaint("{fault: paket_loss, at_s: 3}");
  EXPECT_NE(typo.find("s.yaml:3: key 'faults[0].fault' is 'paket_loss'; allowed: one of: packet_loss, burst_loss"),
            std::string::npos)
      << typo;
  EXPECT_NE(complaint("{fault: packet_loss, at_s: 3, strength: 2}").find("a number from 0 to 1"), std::string::npos);
  EXPECT_NE(complaint("{fault: packet_loss}").find("'faults[0].at_s' is missing"), std::string::npos);
  EXPECT_NE(complaint("{fault: pps_loss, at_s: 1, target: camera}").find("one of: pps"), std::string::npos);
  EXPECT_NE(complaint("{fault: outage, at_s: 1, strength: 1}").find("'faults[0].strength' is not known"),
            std::string::npos);
  EXPECT_NE(complaint("{fault: outage, at_s: 1, until_s: 1}").find("is not known"), std::string::npos);
}

TEST(Scenario, FaultsDoNotChangeWhatIsRendered) {
  EXPECT_EQ(parse_scenario("seed: 2", "s.yaml").fingerprint(),
            parse_scenario("seed: 2\nfaults: [{fault: outage, at_s: 1}]", "s.yaml").fingerprint());
}

TEST(ScenarioDocument, EveryExampleLoads) {
  const auto found = examples(document("scenario.md"));
  EXPECT_GE(found.size(), 1u);
  for (const std::string& text : found) EXPECT_NO_THROW(parse_scenario(text, "docs/scenario.md")) << text;
}

}  // namespace
}  // namespace hueline::config
