#include "console/server/places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>

#include "console/server/json_fields.hpp"
#include "core/printable.hpp"

namespace hueline::console {
namespace {

using nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::uintmax_t kMostSummary = 64'000'000;

std::vector<std::string> yaml_files(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code failed;
  if (folder.empty()) return names;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end && names.size() < Places::kMostDrives;
       at.increment(failed))
    if (at->path().extension() == ".yaml" && is_entry_name(at->path().stem().string()))
      names.push_back(at->path().stem().string());
  std::ranges::sort(names);
  return names;
}

}  // namespace

bool is_entry_name(const std::string& name) {
  return !name.empty() && name.front() != '.' && name.find('/') == std::string::npos && printable(name) == name;
}

ordered_json read_json(const fs::path& file) {
  std::error_code failed;
  const auto size = fs::file_size(file, failed);
  if (failed || size > kMostSummary) return {};
  std::ifstream in(file, std::ios::binary);
  return ordered_json::parse(std::string{std::istreambuf_iterator<char>(in), {}}, nullptr, false);
}

std::vector<std::string> Places::rig_names() const { return yaml_files(rigs); }
std::vector<std::string> Places::scenario_names() const { return yaml_files(scenarios); }

Result<std::string> Places::rig_path(const std::string& rig) const {
  const auto names = rig_names();
  if (std::ranges::find(names, rig) == names.end())
    return Error{ErrorCode::Invalid, "there is no such rig; GET /api/rigs lists them"};
  return (rigs / (rig + ".yaml")).string();
}

ordered_json Places::drives_json(const fs::path& running) const {
  struct Found {
    fs::path folder;
    fs::file_time_type time;
  };
  std::vector<Found> found;
  std::error_code failed;
  for (fs::directory_iterator at(drives, failed), end; !failed && at != end && found.size() < kMostDrives;
       at.increment(failed)) {
    std::error_code ignored;
    const fs::path recording = at->path() / "drive.mcap";
    if (is_entry_name(at->path().filename().string()) && fs::is_regular_file(recording, ignored))
      found.push_back({at->path(), fs::last_write_time(recording, ignored)});
  }
  std::ranges::sort(found, std::greater(), &Found::time);
  constexpr std::size_t kMostListed = 200;
  auto listed = ordered_json::array();
  for (std::size_t i = 0; i < std::min(found.size(), kMostListed); ++i) {
    const fs::path& folder = found[i].folder;
    const ordered_json summary = read_json(folder / "summary.json");
    std::error_code ignored;
    std::uintmax_t bytes = 0;
    for (fs::directory_iterator at(folder, ignored), end; !ignored && at != end; at.increment(ignored)) {
      std::error_code none;
      if (const auto size = at->is_regular_file(none) ? at->file_size(none) : 0; !none) bytes += size;
    }
    listed.push_back({{"name", folder.filename().string()},
                      {"begin", value_at(summary, {"drive", "begin"})},
                      {"duration_s", value_at(summary, {"drive", "duration_s"})},
                      {"path_m", value_at(summary, {"drive", "path_m"})},
                      {"points", value_at(summary, {"points", "total"})},
                      {"coloured_share", value_at(summary, {"points", "coloured_share"})},
                      {"grade", value_at(summary, {"verdict", "grade"})},
                      {"bytes", bytes},
                      {"running", running == folder}});
  }
  return {{"drives", listed}, {"all", found.size()}};
}

Result<fs::path> Places::file_of(const std::string& drive, const std::string& file) const {
  if (!is_entry_name(drive)) return Error{ErrorCode::Invalid, "this is no name of a drive"};
  const fs::path path = drives / drive / file;
  std::error_code ignored;
  // A link could lead anywhere.
  if (fs::symlink_status(path, ignored).type() != fs::file_type::regular)
    return Error{ErrorCode::Unavailable, fmt::format("the drive has no {} (yet)", file)};
  return path;
}

}  // namespace hueline::console
