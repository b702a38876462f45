#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "storage/file_writer.hpp"
#include "storage/las_format.hpp"

namespace hueline::products {

/// A property of a PLY file's vertices.
struct PlyProperty {
  std::string name;
  storage::LasType type = storage::LasType::F32;  ///< not U64 or I64: PLY has none
};

/// Writes a point cloud as binary little-endian PLY 1.0 (Turk, The PLY Polygon File Format, 1994). Thread safety: none.
class PlyFile {
 public:
  /// Creates the file for `points` vertices, each of which has the properties in their order without gaps. A line of
  /// `comments` is a line of the header. Errors: Invalid for a type that PLY does not have; Io.
  static Result<PlyFile> create(const std::filesystem::path& path, const std::vector<std::string>& comments,
                                const std::vector<PlyProperty>& properties, std::uint64_t points);
  /// Appends whole vertices.
  Status add(storage::ByteView vertices) { return file_.write(vertices); }
  Status close() { return file_.close(); }
  std::uint64_t size() const { return file_.size(); }

 private:
  explicit PlyFile(storage::FileWriter file) : file_(std::move(file)) {}
  storage::FileWriter file_;
};

}  // namespace hueline::products
