#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"

namespace hueline::console {

/// Map tiles in a folder, which the page draws under the drive: Z/X/Y.png, .jpg, .jpeg or .webp of the Web Mercator
/// pyramid (EPSG:3857) that web maps share. X counts from the antimeridian eastward, and Y from the north (XYZ) or, if
/// the folder says so, from the south (TMS): by `"scheme": "tms"` in metadata.json, or by a tilemapresource.xml.
/// Thread safety: const functions may be called at once; they read the disk.
class MapTiles {
 public:
  static constexpr int kMostZoom = 24;
  /// File names end so; the second is the type of their content.
  static constexpr std::array<std::pair<std::string_view, const char*>, 4> kTypes{
      {{".png", "image/png"}, {".jpg", "image/jpeg"}, {".jpeg", "image/jpeg"}, {".webp", "image/webp"}}};

  /// Looks at the folder. Errors: Io if it cannot be read; Invalid if it holds no tiles.
  static Result<MapTiles> open(const std::filesystem::path& folder);

  /// `least_zoom`, `most_zoom`, and `attribution`: whom the map is from, as metadata.json says; else empty.
  nlohmann::ordered_json json() const;

  struct File {
    std::filesystem::path path;
    const char* type = "";
  };
  /// Returns the file of a tile; `place` is Z/X/Y, Y from the north. Errors: Invalid if this is no tile of the pyramid;
  /// Unavailable if the folder does not have it.
  Result<File> tile(std::string_view place) const;

 private:
  std::filesystem::path folder_;
  int least_zoom_ = 0, most_zoom_ = 0;
  bool is_from_south_ = false;
  std::string attribution_;
};

}  // namespace hueline::console
