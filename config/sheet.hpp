#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace hueline::config {

/// What `hueline score` drives.
struct Sheet {
  std::vector<std::filesystem::path> scenarios;
  std::size_t ray_returns = 40'000;  ///< score::Scorer::Config::ray_returns
};

/// Reads a sheet: `scenarios:`, a list of scenario files relative to the sheet's own folder, and `ray_returns:`.
/// `name`: a file, or a word (config/shipped.hpp). ConfigError names file, line and key; two files of one name are
/// refused, as the score is by name.
Sheet load_sheet(const std::string& name);

}  // namespace hueline::config
