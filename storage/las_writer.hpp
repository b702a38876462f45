#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "storage/cloud_format.hpp"
#include "storage/file_writer.hpp"
#include "storage/las_fields.hpp"
#include "storage/projection.hpp"

namespace hueline::storage {

/// Returns a day as a decimal year, in which the epochs of coordinates are given.
double decimal_year(const UtcTime& utc);

/// Writes the coloured cloud as LAS or LAZ 1.4, or as COPC 1.0, point format 7: adjusted standard GPS time, steps of 1
/// mm, CRS as OGC WKT, 8-bit colours times 257, and extra bytes as the list of point fields says
/// (core/point_fields.hpp). Reads no clock: the same blocks give the same bytes.
///
/// The header is updated every `header_every` points and by flush(), so a killed program leaves a file that can be read
/// up to that update. The chunks of a LAZ file need their table for that, which belongs behind the last of them: until
/// close() the table of the chunks so far is in a record of its own before the points, in two places by turns, so that
/// a whole one is there at any moment. It has room for some 800 million points; LasReader finds the chunks behind
/// these too. The nodes of a COPC file are written while the points come (storage/point_octree.hpp), the hierarchy by
/// close(); before it, the file is a LAZ file with the nodes so far.
///
/// The first failed write is remembered and returned by all later calls. The file then ends with its
/// last whole write, and its header fits that. Until close() has written everything, the header names kLasUnfinished
/// as the software, so that a file that lacks points says so wherever it is copied to.
/// Thread safety: none; one thread calls all functions. Threads of its own compress while it continues.
class LasWriter {
 public:
  struct Config {
    static constexpr std::uint64_t kOnlyAtTheEnd = 0xFFFFFFFFFFFFFFFF;  ///< for header_every
    MapConfig map;      ///< of the cloud; its epoch 0 is that of `created`
    UtcTime created{};  ///< creation date in the header; the date of the drive, not that of the clock
    std::string system_identifier = "hueline";    ///< in the LAS header, at most 32 bytes
    std::string generating_software = "hueline";  ///< in the LAS header, at most 32 bytes
    std::uint64_t header_every = 1'000'000;       ///< points between two updates of the header
    CloudFormat format = CloudFormat::Las;
    int threads = 1;                          ///< that compress; they do not change the bytes
    std::uint32_t node_points = 65'536;       ///< COPC: points with which a node is full, at least 1
    std::uint64_t octree_bytes = 256u << 20;  ///< COPC: memory for the points of nodes that are not full
    IfExists if_exists = IfExists::Replace;
    std::string validate() const;
  };
  /// Every point that append() looked at is counted in exactly one of these.
  struct Counts {
    std::uint64_t written = 0;  ///< points in the file; until close() also points that wait for it
    /// Points that are not a number, or too far away for the CRS or for 32 bits of millimetres.
    std::uint64_t refused = 0;
    std::uint64_t lost = 0;  ///< points that were accepted, but could not be written to the file
  };

  /// Creates the file. All points must have this origin and the fields of the list. Errors: Invalid (a setting, the
  /// EPSG code), Io.
  template <const auto& Fields = kPointFields>
  static Result<LasWriter> create(const std::filesystem::path& path, const Geodetic& origin, const Config& config) {
    return create(path, origin, config, las_extra_fields<Fields>());
  }
  LasWriter(LasWriter&&) noexcept;
  LasWriter& operator=(LasWriter&&) = delete;
  /// Closes the file if close() was not called. Errors are then not reported.
  ~LasWriter();

  /// Appends the points of a block. Errors: Invalid if the block has another origin; Io.
  Status append(const CloudBlock& block) { return append<kPointFields>(block.origin, std::span(block.points)); }
  /// Appends points whose type derives from ColouredPoint and has more fields. Error: Invalid if the file was created
  /// for another list.
  template <const auto& Fields, class Point>
  Status append(const Geodetic& origin, std::span<const Point> points);
  /// Hands all points so far to the kernel, together with the header that counts them; of a LAZ file those of the
  /// chunks that are full, of a COPC file those of the nodes that are finished.
  Status flush();
  /// Does what flush() does, writes everything to the medium and closes the file.
  Status close();

  /// Also gives the records of all later points to `take`, as they stand in a file that is not compressed and in the
  /// order of append(), when the writer passes them on: some ten thousand at once, the last of them in close().
  void also_give(std::function<void(ByteView records)> take) { take_ = std::move(take); }

  const Counts& counts() const { return counts_; }
  const Projection& projection() const { return projection_; }
  const LasHeader& header() const { return header_; }
  /// The records that describe the points: CRS and extra bytes.
  const std::vector<LasVlr>& records() const { return records_; }
  const std::filesystem::path& path() const { return file_.path(); }

 private:
  static Result<LasWriter> create(const std::filesystem::path& path, const Geodetic& origin, const Config& config,
                                  const std::vector<LasExtraField>& extra);
  LasWriter(FileWriter file, Projection projection, const Config& config);
  Status start(const std::vector<LasExtraField>& extra);
  Status check(const Geodetic& origin, std::size_t extra_size) const;
  struct Compression;
  /// What the header says about points.
  struct Tally {
    Tally();
    void add(const Tally& other);
    std::uint64_t points = 0;
    std::array<std::uint64_t, 15> by_return{};
    std::array<std::int32_t, 3> lowest, highest;  // in the file's steps
    double first_time, last_time;
  };
  Tally tally_of(ByteView records) const;
  Bytes take_buffer();
  Status write_points();
  Status write_records(ByteView bytes, const Tally& points);
  Status fail(Error error);
  Status submit_chunk(Bytes records);
  Status submit_nodes();
  Status submit_rest();
  Status write_chunk();
  Status write_table(bool at_end);
  Status write_hierarchy();
  Status write_header();
  Bytes header_bytes() const;
  Status keep_header();
  std::byte* encode(const ColouredPoint& point);

  FileWriter file_;
  Projection projection_;
  Config config_;
  LasHeader header_;
  std::vector<LasVlr> records_;
  std::function<void(ByteView)> take_;
  Counts counts_;
  Tally in_file_;
  std::optional<Error> error_;
  std::unique_ptr<Compression> laz_;  // of LAZ and COPC
  Bytes buffer_;
  std::size_t used_ = 0;
  std::uint64_t next_header_ = 0;
  bool is_finished_ = false;
};

template <const auto& Fields, class Point>
Status LasWriter::append(const Geodetic& origin, std::span<const Point> points) {
  if (Status fits = check(origin, las_extra_size<Fields>()); !fits) return fits;
  for (const Point& point : points) {
    if (std::byte* extra = encode(point)) put_las_extra<Fields>(point, extra);
    if (used_ < buffer_.size()) continue;
    if (Status written = write_points(); !written) return written;
  }
  return keep_header();
}
extern template Status LasWriter::append<kPointFields>(const Geodetic& origin, std::span<const ColouredPoint> points);

}  // namespace hueline::storage
