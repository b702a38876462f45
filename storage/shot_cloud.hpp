#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>

#include "core/coloured_point.hpp"
#include "storage/pcd_reader.hpp"

/// The cloud of one shot with its colours: what `hueline colour` writes.
namespace hueline::storage {

/// What an image says of one point of a cloud.
struct ShotColour {
  std::size_t row = 0;  ///< of the cloud
  float u = 0, v = 0;   ///< pixel, centres at whole numbers; 0 where the point is not in the image
  std::uint8_t red = 0, green = 0, blue = 0;
  ColourState state = ColourState::Outside;
};

/// What a reader of the file has to know.
struct ShotCloudNotes {
  double step_m = 0;                 ///< of the coordinates
  std::array<double, 3> offset_m{};  ///< LAS header's
  std::string intensity_field;       ///< of the cloud, that gave the LAS intensity; empty: it has none
  double intensity_scale = 0;        ///< LAS intensity = the cloud's times this
  std::string time_field;            ///< of the cloud, that stands as it is in the LAS GPS time; empty: it has none
};

/// Writes LAS 1.4, point format 7, without a CRS: x, y, z are the cloud's own, in steps of 1 um (more, by powers of
/// ten, only where its extent needs it). Every other field of the cloud is kept as extra bytes by its own name and type
/// ("cloud_" before a name that LAS has itself); beside them image_u, image_v and colour_state. 8-byte whole numbers
/// are kept to 53 bits. One record a `ShotColour`, in that order. Reads no clock. Errors: Invalid (no x, y, z; more
/// fields than LAS can describe), Io.
Result<ShotCloudNotes> write_shot_cloud(const std::filesystem::path& path, const PcdCloud& cloud,
                                        std::span<const ShotColour> points);

}  // namespace hueline::storage
