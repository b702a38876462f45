#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "storage/pcd_header.hpp"

namespace hueline::storage {

/// How the values of a field are stored: 'I', 'U' or 'F', and the number of bytes.
struct PcdType {
  char kind = 'F';
  std::size_t size = 4;
};

/// A point cloud file of the Point Cloud Library (PCD 0.6-0.7; ascii, binary or binary_compressed), read into memory.
/// Values keep the units of the file. NaN means "no point", as in PCD.
struct PcdCloud {
  std::vector<std::string> fields;           ///< names without padding; a field with COUNT n > 1 is listed n times
  std::vector<PcdType> types;                ///< of each column
  std::vector<std::vector<double>> columns;  ///< columns[field][point]

  std::size_t points() const { return columns.empty() ? 0 : columns.front().size(); }
  /// Returns the column of this name; empty if the file has none.
  std::span<const double> column(const std::string& field) const;
};

/// Reads a PCD file. Errors: Io; Malformed and Truncated with the line or byte where reading stopped; Unsupported with
/// the limit that is exceeded (4 GB, 4096 columns or 500 million values).
Result<PcdCloud> read_pcd(const std::string& path);
/// Does the same from bytes. `name` stands for the file in messages.
Result<PcdCloud> decode_pcd(std::span<const std::byte> bytes, const std::string& name);
/// Reads the points that a header describes: those of a PCD, or of another table of points whose header says the same.
Result<PcdCloud> decode_points(const PcdHeader& header, std::span<const std::byte> bytes, const std::string& name);

/// Returns the error of a cloud beyond kMostCloudValues, which readers give that find out while they read.
Error too_many_cloud_values(const std::string& name);

constexpr std::uint64_t kMostCloudBytes = 4'000'000'000;  ///< largest file that is read whole into memory
constexpr std::size_t kMostCloudValues = 500'000'000;     ///< numbers of a cloud in memory: 4 GB as double

}  // namespace hueline::storage
