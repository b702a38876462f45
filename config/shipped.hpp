#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hueline::config {

/// A configuration that is part of the program: a file of config/ as it was when the program was built.
struct ShippedFile {
  std::string_view path;  ///< below config/: "scenarios/street.yaml"
  std::string_view text;
};
/// All of them, by path: rigs, scenarios, sheets.
const std::vector<ShippedFile>& shipped_files();

/// In front of the path of a shipped file where a path is wanted: "shipped:/scenarios/street.yaml".
constexpr std::string_view kShipped = "shipped:/";

/// What a user means who names a configuration. A word without '.' and '/' is one that comes with the program, of
/// `kind` ("rigs", "scenarios", "sheets"), given back as its path behind kShipped; anything else, and a word that is a
/// file's name here, is that path. ConfigError for a word that is neither, with those that there are.
std::string configuration_named(const std::string& name, const std::string& kind);

}  // namespace hueline::config
