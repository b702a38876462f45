#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace hueline::config {

/// The scenarios that `hueline score` drives.
struct Sheet {
  std::vector<std::filesystem::path> scenarios;
  std::size_t ray_returns = 40'000;  ///< see score::Scorer::Config::ray_returns
};

/// Reads a sheet: `scenarios:`, a list of scenario files relative to the folder of the sheet, and `ray_returns:`.
/// `name` is a file or the name of a shipped sheet (config/shipped.hpp). Throws ConfigError with file, line and key.
/// Two files with the same name are refused, because the score is listed by name.
Sheet load_sheet(const std::string& name);

}  // namespace hueline::config
