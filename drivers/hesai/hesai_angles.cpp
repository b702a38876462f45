#include "drivers/hesai/hesai_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/input_file.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint64_t kMostBytes = 1'000'000;
constexpr std::size_t kMostChannels = 1024;

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

Result<HesaiAngles> read_hesai_angles(const std::string& path) {
  const auto text = read_input(path, kMostBytes, "a calibration file");
  if (!text.ok()) return text.error();
  HesaiAngles out;
  out.file = path;
  std::istringstream lines(*text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream words(line);
    double channel = 0, elevation = 0, azimuth = 0;
    if (!(words >> channel)) continue;  // names of the columns, or an empty line
    if (!(words >> elevation >> azimuth) || !(std::abs(elevation) <= 90) || !(std::abs(azimuth) <= 360))
      return Error{ErrorCode::Unsupported, fmt::format("{}:{}: no line \"channel,elevation,azimuth\"", path, number)};
    if (channel != static_cast<double>(out.elevations_deg.size() + 1) || out.elevations_deg.size() >= kMostChannels)
      return Error{ErrorCode::Malformed, fmt::format("{}:{}: channel {} where {} is expected", path, number, channel,
                                                     out.elevations_deg.size() + 1)};
    out.elevations_deg.push_back(elevation);
    out.azimuths_deg.push_back(azimuth);
  }
  if (out.elevations_deg.empty())
    return Error{ErrorCode::Unsupported, path + ": no line \"channel,elevation,azimuth\""};
  return out;
}

std::optional<HesaiAngles> find_hesai_angles(const std::string& path, const HesaiTable& table) {
  std::optional<HesaiAngles> found;
  std::error_code error;
  const auto folder = std::filesystem::path(path).parent_path();
  for (std::filesystem::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() != ".csv" || model_named(entry->path()) != &table) continue;
    auto angles = read_hesai_angles(entry->path().string());
    if (!angles.ok() || angles->elevations_deg.size() != table.beams.size()) continue;
    if (found) return {};
    found = std::move(angles).value();
  }
  return found;
}

}  // namespace hueline::drivers
