#pragma once

#include <string>

#include "config/key_documents.hpp"
#include "sim/scenario.hpp"

namespace hueline::config {

/// Loads a scenario of the simulator. `path` is a file or the name of a shipped scenario (config/shipped.hpp). Keys
/// that are absent keep their defaults; sim/scenario.hpp lists the keys with their ranges. Throws ConfigError with file
/// and line for unknown keys, wrong types and values out of range, as load_rig() does.
sim::Scenario load_scenario(const std::string& path);
sim::Scenario parse_scenario(const std::string& text, const std::string& name);

/// Returns the keys of a scenario file for its document.
KeyDocument scenario_document();

}  // namespace hueline::config
