#include "console/server/map_tiles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

#include "console/server/json_fields.hpp"
#include "console/server/places.hpp"

namespace hueline::console {
namespace {

namespace fs = std::filesystem;

/// Reads a whole number of plain digits, and nothing else.
std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

bool is_tile(const fs::path& file) {
  return number(file.stem().string()) &&
         std::ranges::any_of(MapTiles::kTypes, [&](const auto& one) { return file.extension() == one.first; });
}

/// Whether a zoom level's folder, Z, has a tile: X/Y.png. It looks at no more entries than a tidy folder needs.
bool has_tile(const fs::path& level) {
  std::error_code failed;
  for (fs::directory_iterator column(level, failed), end; !failed && column != end; column.increment(failed)) {
    if (!number(column->path().filename().string())) continue;
    std::error_code none;
    for (fs::directory_iterator file(column->path(), none); !none && file != end; file.increment(none))
      if (is_tile(file->path())) return true;
  }
  return false;
}

}  // namespace

Result<MapTiles> MapTiles::open(const fs::path& folder) {
  MapTiles tiles;
  tiles.folder_ = fs::absolute(folder);
  std::error_code failed;
  std::set<int> zooms;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const auto zoom = number(at->path().filename().string());
    if (zoom && *zoom <= kMostZoom && has_tile(at->path())) zooms.insert(static_cast<int>(*zoom));
  }
  if (failed) return Error{ErrorCode::Io, fmt::format("{}: {}", folder.string(), failed.message())};
  if (zooms.empty())
    return Error{ErrorCode::Invalid,
                 fmt::format("{} has no map tiles: expected Z/X/Y.png, .jpg or .webp, as QGIS (\"Generate XYZ tiles "
                             "(Directory)\") and gdal2tiles write them",
                             folder.string())};
  tiles.least_zoom_ = *zooms.begin();
  tiles.most_zoom_ = *zooms.rbegin();
  const auto about = read_json(folder / "metadata.json");
  std::error_code ignored;
  if (about.is_object()) {
    tiles.attribution_ = text_in(about, "attribution");
    tiles.is_from_south_ = text_in(about, "scheme") == "tms";
  } else {
    tiles.is_from_south_ = fs::exists(folder / "tilemapresource.xml", ignored);
  }
  return tiles;
}

nlohmann::ordered_json MapTiles::json() const {
  return {{"least_zoom", least_zoom_}, {"most_zoom", most_zoom_}, {"attribution", attribution_}};
}

Result<MapTiles::File> MapTiles::tile(std::string_view place) const {
  const std::size_t first = place.find('/'), second = place.rfind('/');
  const Error wrong{ErrorCode::Invalid, "a tile is Z/X/Y"};
  if (first == std::string_view::npos || first == second) return wrong;
  const auto z = number(place.substr(0, first)), x = number(place.substr(first + 1, second - first - 1)),
             y = number(place.substr(second + 1));
  if (!z || !x || !y || *z > kMostZoom || *x >> *z != 0 || *y >> *z != 0) return wrong;
  const std::uint32_t row = is_from_south_ ? (1U << *z) - 1 - *y : *y;
  for (const auto& [ending, type] : kTypes) {
    File file{folder_ / fmt::format("{}/{}/{}{}", *z, *x, row, ending), type};
    std::error_code ignored;
    if (fs::is_regular_file(file.path, ignored)) return file;
  }
  return Error{ErrorCode::Unavailable, "the folder of the map has no such tile"};
}

}  // namespace hueline::console
