#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/frames.hpp"
#include "storage/e57_description.hpp"
#include "storage/e57_pages.hpp"

/// Reads the points of E57 files (ASTM E2807-11), in which programs of static scanners exchange clouds.
namespace hueline::storage {

/// Streams the points of the scans of a file of any size; memory holds its description (at most 64 MB of XML), 256
/// pages and the packets that the next points need. Images, which a file may have, too, are counted and not read.
/// Move-only. Thread safety: none.
class E57Reader {
 public:
  /// Opens a file and reads its description. Errors: Io; Malformed (also a file that its writer has not closed);
  /// Truncated; Unsupported (fields that are no numbers).
  static Result<E57Reader> open(const std::filesystem::path& path);

  const std::vector<E57Scan>& scans() const { return description_.scans; }
  std::size_t images() const { return description_.images; }
  /// Returns the CRS of the file's coordinates (E57Description::crs).
  const std::string& crs() const { return description_.crs; }

  /// Goes to the first point of a scan. Errors: those of next().
  Status begin(std::size_t scan);
  /// Replaces `columns` by the values of the next points, at most `most` of them: columns[i] has those of column i of
  /// the scan. They are empty at the scan's end. Errors, after what is whole was returned: Io; Malformed; Truncated if
  /// the scan holds fewer points than it counts; Unsupported if a field's values come 16 MB before another's.
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
  E57Description description_;

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
