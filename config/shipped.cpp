#include "config/shipped.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "config/section.hpp"
#include "core/nearest_word.hpp"

namespace hueline::config {

std::string configuration_named(const std::string& name, const std::string& kind) {
  std::error_code ignored;
  const auto found = std::filesystem::status(name, ignored);
  const bool is_file = std::filesystem::exists(found) && !std::filesystem::is_directory(found);
  if (name.empty() || name.find_first_of("./") != std::string::npos || is_file) return name;
  std::vector<std::string> words;
  for (const ShippedFile& file : shipped_files()) {
    const std::filesystem::path path(file.path);
    if (path.parent_path() == kind) words.push_back(path.stem().string());
    if (file.path == fmt::format("{}/{}.yaml", kind, name)) return std::string(kShipped) + std::string(file.path);
  }
  throw ConfigError(fmt::format(
      "{}: no such file is here, and none of the {} that come with the program has that name{}; those are: {}", name,
      kind, did_you_mean(name, words), fmt::join(words, ", ")));
}

}  // namespace hueline::config
