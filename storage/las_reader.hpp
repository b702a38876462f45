#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "storage/las_format.hpp"
#include "storage/laz_chunk.hpp"

namespace hueline::storage {

/// One decoded point record.
struct LasPoint {
  double x = 0, y = 0, z = 0;  ///< in the file's CRS
  std::uint16_t intensity = 0;
  std::uint8_t return_number = 0, return_count = 0, classification = 0, user_data = 0;
  std::uint16_t source = 0;  ///< point source id; in files of this program the SensorId
  double scan_angle_deg = 0;
  std::optional<double> time;  ///< as stored: adjusted standard GPS time or time of week, see LasReader::gps_time()
  std::uint16_t red = 0, green = 0, blue = 0;  ///< 0 if the format has no colour
  ByteView record;                             ///< the stored bytes; valid until the next call of next()
};

/// Streams the points of a LAS 1.0 to 1.4 file, point formats 0 to 10, and of a LAZ file, point formats 0 to 3 and 6
/// to 8. Of the waveforms of the formats 4, 5, 9 and 10 only the bytes in the records are read.
/// If the table of a LAZ file's chunks is missing, because the file was cut, the chunks are found one after another, up
/// to the last whole one. Memory: one chunk. Move-only.
/// Thread safety: none; one thread calls all functions.
class LasReader {
 public:
  /// Opens the file and reads its header and records. Errors: Io; Malformed; Truncated (inside the header); Unsupported
  /// (other point formats, other kinds of LAZ).
  static Result<LasReader> open(const std::filesystem::path& path);

  const LasHeader& header() const { return header_; }
  /// Number of points that the file really holds. It is smaller than the header's count if the file was cut.
  std::uint64_t available() const { return available_; }
  /// The records in front of the points, and of those behind them (of version 1.4) all that are no larger than 65535
  /// bytes.
  const std::vector<LasVlr>& records() const { return vlrs_; }
  /// Names the records that are not in records(), each in a few words.
  const std::vector<std::string>& left_out() const { return left_out_; }
  const std::vector<LasExtraField>& extra_fields() const { return extra_; }
  /// Returns the field of that name, or null.
  const LasExtraField* extra_field(std::string_view name) const;
  /// Returns the CRS as OGC WKT, of the record of LAS 1.4 or that of libLAS; empty if the file has none.
  std::string wkt() const;
  /// Returns whether the point format has colours.
  bool has_colour() const;
  /// Returns whether the 16-bit colours hold values of 8 bits, as many programs write them: whether none is above 255.
  /// Reads points until one is; then the next point is the first again. Errors: those of next() but Truncated.
  Result<bool> has_byte_colours();
  /// Returns the time of a point. Nothing if the file's times are GPS times of week, because the week is not in the
  /// file.
  std::optional<GpsTime> gps_time(const LasPoint& point) const;
  /// Returns the value of an extra field, scaled as the file says.
  static double extra(const LasPoint& point, const LasExtraField& field);

  /// Replaces `out` by the next points, at most `most` of them. It returns fewer only before the end, and none at the
  /// end. Error: Truncated if the file holds fewer points than its header says, after all whole points were returned;
  /// later calls repeat it.
  Status next(std::vector<LasPoint>& out, std::size_t most = 65536);
  /// Begins again at the first point.
  void rewind() { read_ = 0; }
  /// Returns whether the points are compressed.
  bool is_compressed() const { return chunk_points_ != 0; }

 private:
  explicit LasReader(InputFile file) : file_(std::move(file)) {}
  Status read_records();
  Status read_extended_records();
  Status read_record(LasVlr vlr, std::uint64_t offset, std::size_t size);
  Status find_chunks(const LasVlr& vlr);
  Status walk_chunks(std::uint64_t at);
  Status walk_unmeasured_chunks(std::uint64_t at);
  std::uint32_t points_at_most(const LazRecord& kind) const;
  Status fill(std::size_t count);
  Status fill_from_chunks(std::size_t count);
  void decode(ByteView record, LasPoint& point) const;

  InputFile file_;
  LasHeader header_;
  std::vector<LasVlr> vlrs_;
  std::vector<std::string> left_out_;
  std::vector<LasExtraField> extra_;
  std::uint64_t read_ = 0, available_ = 0;
  Bytes buffer_;

  /// A chunk of a LAZ file.
  struct Chunk {
    std::uint64_t offset = 0, bytes = 0, first = 0;  // in the file; number of its first point
    std::uint32_t points = 0;
  };
  std::uint32_t chunk_points_ = 0;  // 0: the file is not compressed
  int item_version_ = 3;            // of its compression
  std::vector<Chunk> chunks_;
  std::optional<std::size_t> unpacked_;  // the chunk whose records are in `unpacked_records_`
  Bytes packed_, unpacked_records_;
};

}  // namespace hueline::storage
