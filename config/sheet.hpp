#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hueline::config {

/// Reads a sheet: `scenarios:`, a list of scenario files relative to the sheet's own folder. `name`: a file, or a word for
/// config/sheets/WORD.yaml below the working folder. ConfigError names file, line and key; two files of one name are refused, as the
/// score is by name.
std::vector<std::filesystem::path> load_sheet(const std::string& name);

}  // namespace hueline::config
