#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>

#include "core/coloured_point.hpp"
#include "storage/pcd_reader.hpp"

/// Writes the coloured cloud of one shot, the output of `hueline colour`.
namespace hueline::storage {

/// The colour of one point of a cloud, from one image.
struct ShotColour {
  std::size_t row = 0;  ///< row of the point in the cloud
  float u = 0, v = 0;   ///< pixel in the image, whole numbers at pixel centres; 0 if the point is not in the image
  std::uint8_t red = 0, green = 0, blue = 0;
  ColourState state = ColourState::Outside;
};

/// What a user of the written file must know.
struct ShotCloudNotes {
  double step_m = 0;                 ///< step of the stored coordinates
  std::array<double, 3> offset_m{};  ///< offset in the LAS header
  std::string intensity_field;       ///< field of the cloud that became the LAS intensity; empty if there is none
  double intensity_scale = 0;        ///< LAS intensity = value in the cloud times this
  std::string time_field;  ///< field of the cloud that is stored unchanged as LAS GPS time; empty if there is none
};

/// Returns the name of the field with the strength of the returns, as sensors' drivers and programs call it; empty if
/// the cloud has none.
std::string intensity_field(const PcdCloud& cloud);

/// Writes LAS 1.4, point format 7, without a CRS. x, y and z are the cloud's own, in steps of 1 um; the step is larger,
/// by a power of ten, only if the extent of the cloud needs it. Every other field of the cloud becomes extra bytes with
/// its own name and type ("cloud_" is put before a name that LAS itself uses), and the fields image_u, image_v and
/// colour_state are added. Integers of 8 bytes are kept to 53 bits. The file holds one record for each element of
/// `points`, in their order. Reads no clock. Errors: Invalid (no x, y, z, or more fields than LAS can describe), Io.
Result<ShotCloudNotes> write_shot_cloud(const std::filesystem::path& path, const PcdCloud& cloud,
                                        std::span<const ShotColour> points);

}  // namespace hueline::storage
