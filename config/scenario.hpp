#pragma once

#include <string>

#include "config/key_documents.hpp"
#include "sim/scenario.hpp"

namespace hueline::config {

/// Reads a simulator's scenario. Keys that are absent keep their defaults (sim/scenario.hpp lists them with their
/// ranges); unknown, mistyped and out-of-range keys are ConfigErrors with file and line, as in a rig. `path`: a file,
/// or a word (config/shipped.hpp).
sim::Scenario load_scenario(const std::string& path);
sim::Scenario parse_scenario(const std::string& text, const std::string& name);

/// The keys of a scenario file, for its document.
KeyDocument scenario_document();

}  // namespace hueline::config
