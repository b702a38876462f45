#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/frames.hpp"
#include "core/time.hpp"
#include "storage/e57_pages.hpp"

/// Reads the points of E57 files (ASTM E2807-11), in which programs of static scanners exchange clouds.
namespace hueline::storage {

/// The coordinates of a whole file, m, in which each of its scans has a pose.
struct E57World {};

/// A field of the points of a scan, as the file describes it.
struct E57Column {
  enum class Kind : std::uint8_t { Float32, Float64, Integer };
  std::string name;  ///< of the standard, such as "cartesianX", or of an extension, such as "nor:normalX"
  Kind kind = Kind::Float64;
  unsigned bits = 64;                     ///< of a value; with 0 bits all values are the least
  std::int64_t minimum = 0, maximum = 0;  ///< of an integer, before it is scaled
  double scale = 1, offset = 0;           ///< value = integer * scale + offset
};

/// One scan of a file: points that were taken from one place, or that a program has put together.
struct E57Scan {
  std::string name;
  std::string sensor;        ///< maker, model and serial number, as far as they are known
  std::uint64_t points = 0;  ///< as the file counts them, with those that have no place
  std::vector<E57Column> columns;
  Transform<E57World, Scanner> T_world_scanner;
  std::optional<GpsTime> begin;  ///< of the acquisition

  /// Returns the index of a column, or nothing.
  std::optional<std::size_t> column(std::string_view wanted) const;

  std::uint64_t section = 0;  ///< where its points begin, in the file
};

/// Streams the points of the scans of a file. Images, which a file may have, too, are counted and not read. Move-only.
/// Thread safety: none.
class E57Reader {
 public:
  /// Opens a file and reads its description. Errors: Io; Malformed (also a file that its writer has not closed);
  /// Truncated; Unsupported (fields that are no numbers).
  static Result<E57Reader> open(const std::filesystem::path& path);

  const std::vector<E57Scan>& scans() const { return scans_; }
  std::size_t images() const { return images_; }
  /// Returns the CRS of the file's coordinates as the file says it (WKT as a rule); empty if it says none.
  const std::string& crs() const { return crs_; }

  /// Goes to the first point of a scan. Errors: those of next().
  Status begin(std::size_t scan);
  /// Replaces `columns` by the values of the next points, at most `most` of them: columns[i] has those of column i of
  /// the scan. They are empty at the scan's end. Errors, after what is whole was returned: Io; Malformed; Truncated if
  /// the scan holds fewer points than it counts.
  Status next(std::vector<std::vector<double>>& columns, std::size_t most = 65536);

 private:
  /// The bytes of a column that were read and are not yet values.
  struct Stream {
    Bytes bytes;
    std::size_t at_bit = 0;
  };

  explicit E57Reader(E57Pages pages) : pages_(std::move(pages)) {}
  Status read_packet();
  std::size_t whole_values() const;
  std::string name() const { return pages_.file().path().string(); }

  E57Pages pages_;
  std::vector<E57Scan> scans_;
  std::size_t images_ = 0;
  std::string crs_;

  std::size_t scan_ = 0;
  std::vector<Stream> streams_;
  std::uint64_t left_ = 0;          // points of the scan
  std::uint64_t at_ = 0, end_ = 0;  // next packet and end of the section, in the content
};

/// Replaces `places` by the places of points in their scanner's own frame, from cartesian or spherical coordinates. A
/// point without a place, as where nothing came back, is NaN. `columns` are those of E57Reader::next().
void e57_places(const E57Scan& scan, const std::vector<std::vector<double>>& columns,
                std::vector<Point<Scanner>>& places);

}  // namespace hueline::storage
