#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "fusion/panorama_renderer.hpp"
#include "survey/drive_panoramas.hpp"

/// The table panoramas.csv, which lies beside the panoramas of a drive (docs/formats.md).
namespace hueline::survey {

/// Returns the line with the names of the columns. `unit` is what easting and northing count, and `up_unit` what the
/// height does: "m", "ft" or "ftUS".
std::string panorama_table_head(const std::string& unit = "m", const std::string& up_unit = "m");
/// Returns the line of a panorama that lies in the file `name`. `place` is its easting, northing and height on the map.
std::string panorama_table_line(const DrivePanorama& panorama, const std::string& name, const Eigen::Vector3d& place);

/// A panorama of the table.
struct ListedPanorama {
  fusion::PanoramaView view;    ///< its size, and how it is turned against the head
  std::optional<GpsTime> time;  ///< middle of its exposure; empty: the table does not say it
};

/// Reads how each panorama, by its exposure, is drawn. `file` is the name of the table in messages. Errors: Malformed,
/// with the line.
Result<std::map<std::uint32_t, ListedPanorama>> parse_panorama_table(const std::string& text, const std::string& file);

}  // namespace hueline::survey
