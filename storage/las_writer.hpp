#pragma once

#include <memory>

#include "core/coloured_point.hpp"
#include "storage/file_writer.hpp"
#include "storage/las_format.hpp"
#include "storage/projection.hpp"

namespace hueline::storage {

/// Writes the coloured cloud: LAS 1.4, point format 7, adjusted standard GPS time, steps of 1 mm, CRS as OGC WKT, 8-bit
/// colours times 257, and per point as extra bytes: exposure, channel, lens, quality, colour_state, sigma and the pixel
/// (image_u, image_v). Thread-bound. Reads no clock: the same blocks give the same bytes.
///
/// The header is brought up to date every `header_every` points and by flush(): a killed program leaves a file that
/// reads up to there. The first failed write is remembered and returned by all later calls; the file then ends with its
/// last whole write and has the header to match.
class LasWriter {
 public:
  struct Config {
    int epsg = 0;                                 ///< projected CRS of the cloud; 0: the UTM zone of the drive
    UtcTime created{};                            ///< the header's creation date: that of the drive, never of the clock
    std::string system_identifier = "hueline";    ///< LAS header, at most 32 bytes
    std::string generating_software = "hueline";  ///< LAS header, at most 32 bytes
    std::uint64_t header_every = 1'000'000;       ///< points between updates of the header
    IfExists if_exists = IfExists::Replace;
    std::string validate() const;
  };
  /// Every point that append() looked at is counted in exactly one of the three.
  struct Counts {
    std::uint64_t written = 0;  ///< in the file (or waiting for it, until close())
    std::uint64_t refused = 0;  ///< not a number, or too far away for the CRS or for 32 bits of millimetres
    std::uint64_t lost = 0;     ///< taken, but the file refused them
  };

  /// Blocks must have this origin. Errors: Invalid (setting, EPSG), Io.
  static Result<LasWriter> create(const std::filesystem::path& path, const Geodetic& origin, const Config& config);
  LasWriter(LasWriter&&) noexcept = default;
  LasWriter& operator=(LasWriter&&) = delete;
  /// Closes if close() was not called; then nobody hears of an error.
  ~LasWriter();

  /// Invalid if the block has another origin; Io.
  Status append(const CloudBlock& block);
  /// All points so far to the kernel, and the header that counts them.
  Status flush();
  /// flush(), to the medium, and the end.
  Status close();

  const Counts& counts() const { return counts_; }
  const Projection& projection() const { return projection_; }
  const LasHeader& header() const { return header_; }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  LasWriter(FileWriter file, Projection projection, const Config& config);
  Status start();
  Status write_points();
  Status write_header();
  void encode(const ColouredPoint& point);

  FileWriter file_;
  Projection projection_;
  Config config_;
  LasHeader header_;
  Counts counts_;
  /// What the header says of the points; a copy is kept from the last write that succeeded.
  struct Tally {
    std::uint64_t points = 0;
    std::array<std::uint64_t, 15> by_return{};
    std::array<std::int32_t, 3> lowest, highest;  // in the file's steps
  };
  Tally tally_, in_file_;
  std::optional<Error> error_;
  Bytes buffer_;
  std::size_t used_ = 0;
  std::uint64_t next_header_ = 0;
};

}  // namespace hueline::storage
