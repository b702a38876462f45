#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hueline::config {

/// A configuration that is part of the program: a file of config/ as it was when the program was built.
struct ShippedFile {
  std::string_view path;  ///< below config/, e.g. "scenarios/street.yaml"
  std::string_view text;
};
/// Returns all of them, sorted by path: rigs, scenarios and sheets.
const std::vector<ShippedFile>& shipped_files();

/// Stands in front of the path of a shipped file where a path is expected: "shipped:/scenarios/street.yaml".
constexpr std::string_view kShipped = "shipped:/";

/// Returns the path of the configuration that a user means. A word without '.' and '/' names a configuration of this
/// program of the given `kind` ("rigs", "scenarios", "sheets"), and its path behind kShipped is returned. Anything else
/// is a path, and so is a word that is the name of an existing file (a folder of that name, as results have, is none).
/// Throws ConfigError, with the available names, for a word that is neither.
std::string configuration_named(const std::string& name, const std::string& kind);

}  // namespace hueline::config
