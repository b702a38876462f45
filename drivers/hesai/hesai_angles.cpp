#include "drivers/hesai/hesai_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace hueline::drivers {
namespace {

/// Returns the model whose word is the longest in the file's name.
const HesaiTable* model_named(const std::filesystem::path& file) {
  std::string name = file.stem().string();
  std::erase_if(name, [](char c) { return c == '-' || c == '_' || c == ' '; });
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const HesaiTable* found = nullptr;
  for (const HesaiTable& table : hesai_tables())
    if (name.find(table.file_word) != std::string::npos &&
        (!found || std::strlen(table.file_word) > std::strlen(found->file_word)))
      found = &table;
  return found;
}

}  // namespace

std::string why_not_of(const HesaiTable& table, const BeamAngles& angles) {
  std::vector<ModelAngles> models;
  for (const HesaiTable& one : hesai_tables()) models.push_back({one.name, angles_of(one.beams)});
  return why_not_of({table.name, angles_of(table.beams)}, models, angles,
                    fmt::format("it has {} channels, the model {}", angles.elevations_deg.size(), table.beams.size()));
}

std::optional<BeamAngles> find_hesai_angles(const std::string& path, const HesaiTable& table) {
  std::optional<BeamAngles> found;
  std::error_code error;
  const auto folder = std::filesystem::path(path).parent_path();
  for (std::filesystem::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() != ".csv" || model_named(entry->path()) != &table) continue;
    auto angles = read_beam_angles(entry->path().string());
    if (!angles.ok() || angles->elevations_deg.size() != table.beams.size()) continue;
    if (found) return {};
    found = std::move(angles).value();
  }
  return found;
}

}  // namespace hueline::drivers
