#include "drivers/hesai/hesai_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

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

/// Returns the directions that the maker's manual has for a model.
BeamAngles nominal_angles(const HesaiTable& table) {
  BeamAngles out;
  for (const HesaiBeam& beam : table.beams) {
    out.elevations_deg.push_back(beam.elevation_deg);
    out.azimuths_deg.push_back(beam.azimuth_deg);
  }
  return out;
}

bool has_as_many(const HesaiTable& table, const BeamAngles& angles) {
  return angles.elevations_deg.size() == table.beams.size() && angles.azimuths_deg.size() == table.beams.size();
}

}  // namespace

std::string why_not_of(const HesaiTable& table, const BeamAngles& angles) {
  std::string others;
  for (const HesaiTable& other : hesai_tables())
    if (has_as_many(other, angles) && off_nominal(angles, nominal_angles(other)).empty())
      others += fmt::format("{}{}", others.empty() ? "" : " or ", other.name);
  std::string wrong = has_as_many(table, angles) ? off_nominal(angles, nominal_angles(table))
                                                 : fmt::format("it has {} channels, the model {}",
                                                               angles.elevations_deg.size(), table.beams.size());
  if (wrong.empty()) return {};
  return fmt::format(
      "these are not the directions of a {}: {}; a scanner's own are within {} deg of its model's{}; give the file of "
      "this very scanner",
      table.name, wrong, kMostOffNominal_deg, others.empty() ? "" : ", and these fit the model " + others);
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
