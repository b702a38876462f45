#pragma once

#include <string>

#include "sim/scenario.hpp"

namespace hueline::config {

/// Reads a simulator's scenario. Keys that are absent keep their defaults (sim/scenario.hpp lists them with their ranges); unknown,
/// mistyped and out-of-range keys are ConfigErrors with file and line, as in a rig. `path`: a file, or a word (config/shipped.hpp).
sim::Scenario load_scenario(const std::string& path);
sim::Scenario parse_scenario(const std::string& text, const std::string& name);

}  // namespace hueline::config
