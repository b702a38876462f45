#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>

#include "core/calendar.hpp"
#include "core/measurements.hpp"
#include "core/result.hpp"
#include "storage/file_writer.hpp"
#include "storage/las_format.hpp"

namespace hueline::storage {

/// A return as a file of one scanner holds it, and the time at which the laser fired.
struct ScannerPoint {
  LaserReturn laser;
  /// Seconds of the clock that ScannerCloudWriter::Config names: GPS time less 10^9 s for LAS, Unix time for PCD, or
  /// seconds of the scanner's own counter.
  double time_s = 0;
};

/// Writes the returns of one scanner in its own frame, in a file of any size: LAS 1.4 (point format 6, steps of 0.1 mm)
/// or PCD (binary). close() finishes the header. The first failed write is remembered. Reads no clock.
/// Thread safety: none; one thread calls all functions.
///
///   what           LAS                                       PCD
///   place          x y z, m                                  x y z, F4, m
///   strength       intensity: reflectivity times 257         intensity, U1: the scanner's reflectivity, 0 to 255
///   time           GPS time                                  time, F8, s
///   ring           extra bytes `channel`                     ring, U2
///   return         return number, number of returns          return_number, return_count, U1
///   direction      extra bytes `azimuth`, rad                azimuth, F4, rad
///   distance       extra bytes `range`, m                    range, F4, m
class ScannerCloudWriter {
 public:
  enum class Format : std::uint8_t { Las, Pcd };
  struct Config {
    Format format = Format::Las;
    bool has_gps_time = false;  ///< the times are absolute; otherwise they are those of the scanner's counter
    std::string scanner;        ///< what sent the points; goes into the file
    std::string clock;          ///< in words, what `time` counts; goes into the file
    UtcTime created{};          ///< creation date of a LAS file: that of its data
  };

  static Result<ScannerCloudWriter> create(const std::filesystem::path& path, const Config& config);

  Status append(std::span<const ScannerPoint> points);
  /// Finishes the header, syncs and closes.
  Status close();
  std::uint64_t points() const { return header_.point_count; }

 private:
  ScannerCloudWriter(FileWriter file, const Config& config);
  Bytes head() const;
  void append_las(const ScannerPoint& point);
  void append_pcd(const ScannerPoint& point);

  FileWriter file_;
  Config config_;
  LasHeader header_;  // counts the points of a PCD file too
  std::array<std::int32_t, 3> lowest_, highest_;
  Bytes buffer_;
};

}  // namespace hueline::storage
