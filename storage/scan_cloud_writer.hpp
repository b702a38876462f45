#pragma once

#include <array>
#include <filesystem>
#include <span>

#include "core/calendar.hpp"
#include "core/result.hpp"
#include "storage/file_writer.hpp"
#include "storage/las_format.hpp"

namespace hueline::storage {

/// Writes the bare coordinates of a cloud of any size, as LAS 1.4 (point format 6, steps of 1 mm, no CRS) or as float32
/// x y z about an origin. close() finishes the header of the LAS file. The first failed write is remembered.
/// Thread safety: none; one thread calls all functions.
class ScanCloudWriter {
 public:
  enum class Format { Las, Float32 };

  /// Creates the file. Coordinates are stored as differences from `origin`. A LAS file has the origin as its header's
  /// offset; a Float32 file does not contain it.
  static Result<ScanCloudWriter> create(const std::filesystem::path& path, Format format,
                                        const std::array<double, 3>& origin, const UtcTime& created);

  /// Appends points as x y z x y z ..., each less `origin`, m. Error: Invalid for a point too far from the origin for
  /// LAS (2147 km).
  Status append(std::span<const double> xyz_from_origin);
  /// Finishes the header of a LAS file, syncs and closes.
  Status close();
  std::uint64_t points() const { return header_.point_count; }

 private:
  ScanCloudWriter(FileWriter file, Format format, const std::array<double, 3>& origin, const UtcTime& created);

  FileWriter file_;
  Format format_;
  LasHeader header_;
  std::array<std::int32_t, 3> lowest_, highest_;
  Bytes buffer_;
};

}  // namespace hueline::storage
