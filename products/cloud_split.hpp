#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "products/cloud_export.hpp"
#include "storage/las_format.hpp"

/// Writes a cloud in parts: strips of the drive, or tiles of the map.
namespace hueline::products {

/// How a cloud is cut.
struct CloudSplit {
  enum class Kind : std::uint8_t {
    Time,      ///< strips of so many seconds, at whole multiples of GPS time
    Distance,  ///< strips of so many metres of the path
    Tile,      ///< squares of the map whose sides are so many metres, at whole multiples of the coordinates
  };
  Kind kind = Kind::Time;
  double size = 0;  ///< s or m, greater than 0

  /// Reads "time:60s", "distance:500m" or "tile:100m"; the unit may be left out. Errors: Invalid, with what is allowed.
  static Result<CloudSplit> parse(const std::string& text);
};

/// A part of a cloud.
struct CloudPart {
  std::filesystem::path file;                  ///< its name in the folder
  std::uint16_t strip = 0;                     ///< point source id of all its points; 0: it is a tile
  std::uint64_t points = 0, bytes = 0;         ///< of the file
  std::array<double, 3> minimum{}, maximum{};  ///< in the cloud's CRS
  GpsTime first{}, last{};                     ///< the first and the last firing
};

/// What was written.
struct SplitCloud {
  std::vector<CloudPart> parts;
  bool source_was_cut = false;  ///< the cloud ended before its header says: what is whole was written
  /// Files of parts that a run before this one, which was killed, had left unfinished in the folder.
  std::size_t unfinished_removed = 0;
};

/// Writes a LAS or LAZ cloud of the point formats 6 to 8 as LAZ files in `folder`, or as COPC if `is_copc`. Every point
/// comes into one part, in the order of the cloud, and a part's header describes that part. Tiles keep the records as
/// they are. The points of a strip get its number as point source id, and their scanner's number, which was there, as
/// user data.
///
/// The cloud is read once to count, and then as often as needed so that at most 32 files are open at once (as a rule
/// once). Memory: a chunk for each thread and open file. `ends` are the times at which each strip but the last ends,
/// for Kind::Distance. Errors: those of export_laz() and export_copc(); Invalid if strips are asked for and the points
/// have no GPS time, or if there would be more than 65535 strips or 20 000 tiles, or if the cloud would have to be read
/// more than 100 times, which is known before a part is written; EndOfData if the cloud has no points.
Result<SplitCloud> split_cloud(const std::filesystem::path& cloud, const std::filesystem::path& folder,
                               const CloudSplit& split, const std::vector<GpsTime>& ends, bool is_copc,
                               const CloudExport& options);

/// Writes the index of the parts as GeoJSON (RFC 7946): a rectangle for each part, in longitude and latitude on the
/// datum of the cloud's CRS, with its file, number of points, bounds and times. Returns how many parts have no
/// rectangle: all without a CRS, and with one that is neither projected nor geographic; those whose coordinates are no
/// places of the CRS. Errors: Io.
Result<std::size_t> write_part_index(const std::filesystem::path& path, const std::vector<CloudPart>& parts,
                                     const std::string& wkt);

/// Cuts a drive into strips of `length_m` by the places where the vehicle was. Steps below half a metre count once they
/// add up, so that a standing vehicle drives nowhere. Thread safety: none.
class PathStrips {
 public:
  explicit PathStrips(double length_m) : length_m_(length_m) {}
  /// Adds a place, in order of time, in any fixed Cartesian frame, m.
  void add(GpsTime time, const std::array<double, 3>& place);
  /// The times at which each strip but the last ends.
  const std::vector<GpsTime>& ends() const { return ends_; }

 private:
  double length_m_, driven_m_ = 0;
  std::optional<std::array<double, 3>> last_;
  std::vector<GpsTime> ends_;
};

}  // namespace hueline::products
