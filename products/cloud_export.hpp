#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

/// Writes a finished cloud in another form: the records stay as they are, byte for byte.
namespace hueline::products {

struct CloudExport {
  int threads = 2;  ///< that compress; they do not change the bytes
  /// COPC: with how many points a node of the octree is full, at least 1.
  std::uint32_t node_points = 65'536;
  /// COPC: memory for the points of nodes that are not full. With another memory the nodes are others.
  std::uint64_t held_bytes = 1u << 30;
};

/// What was written.
struct ExportedCloud {
  std::uint64_t points = 0, bytes = 0;
  std::size_t nodes = 0;              ///< chunks; with COPC the nodes of the octree
  bool source_was_cut = false;        ///< the cloud ended before its header says: what is whole was written
  std::vector<std::string> left_out;  ///< records of the cloud that are not in the copy, each in a few words
};

/// Returns an error of reading the cloud so that it is known from one of the new file: Unavailable in place of Io.
inline Error source_error(Error error) {
  if (error.code == ErrorCode::Io) error.code = ErrorCode::Unavailable;
  return error;
}

/// Writes a LAS or LAZ cloud of the point formats 6 to 8 as LAZ 1.4 with chunks of 50 000 points.
/// Errors: those of LasReader, as source_error(); Invalid for another point format; Io of the new file.
Result<ExportedCloud> export_laz(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                 const CloudExport& options);

/// Writes such a cloud as COPC 1.0 (copc.io), a LAZ 1.4 file whose chunks are the nodes of an octree
/// (storage/point_octree.hpp). The cloud is read once. Every point is in one node; the same cloud gives the same bytes.
/// Errors: as export_laz(); EndOfData if the cloud has no points, which COPC cannot say.
Result<ExportedCloud> export_copc(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                  const CloudExport& options);

/// Writes a LAS or LAZ cloud as binary little-endian PLY: places as doubles, colours with 8 bits, intensity, returns,
/// class, sensor, time, and extra bytes under their own names. A field with a scale, or of 64 bits, becomes a double.
/// Scan angle, user data, flags, scanner channel and near infrared are left out. Memory: a batch of points.
/// Errors: as export_laz().
Result<ExportedCloud> export_ply(const std::filesystem::path& cloud, const std::filesystem::path& out);

/// Writes a LAS or LAZ cloud as E57 (ASTM E2807): one scan in the cloud's coordinates, counted in metres, with
/// intensity, return, colours of 8 bits, and times in seconds after the earliest point's if the cloud has absolute
/// times (it is then read twice). `software` is told in the file. Memory: a batch of points. Errors: as
/// export_laz(), and those of crs_in_metres().
Result<ExportedCloud> export_e57(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                 const std::string& software);

}  // namespace hueline::products
