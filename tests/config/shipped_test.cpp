#include <gtest/gtest.h>

#include <filesystem>

#include "config/rig.hpp"
#include "config/scenario.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::config {
namespace {

int load_all(const std::filesystem::path& folder, auto load) {
  int loaded = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    EXPECT_NO_THROW(load(file.path().string())) << file.path();
    ++loaded;
  }
  return loaded;
}

TEST(Shipped, EveryRigAndScenarioLoads) {
  EXPECT_GE(load_all(test::source_dir() / "config/rigs", load_rig), 1);
  EXPECT_GE(load_all(test::source_dir() / "config/scenarios", load_scenario), 3);
}

TEST(Shipped, ATypoInARigIsRefusedWithItsLine) {
  const Rig rig = load_rig((test::source_dir() / "config/rigs/street.yaml").string());
  std::string text = rig.text;
  text.replace(text.find("event_input"), 11, "event_imput");
  try {
    parse_rig(text, "rig.yaml");
    FAIL() << "a typo was taken";
  } catch (const ConfigError& e) {
    const std::string said = e.what();
    EXPECT_NE(said.find("rig.yaml:"), std::string::npos) << said;
    EXPECT_NE(said.find("event_i"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace hueline::config
