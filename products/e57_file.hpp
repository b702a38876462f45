#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "storage/byte_order.hpp"
#include "storage/file_writer.hpp"

namespace hueline::products {

/// A field of an E57 file's points.
struct E57Field {
  enum class Type : std::uint8_t {
    Double,  ///< 8 bytes
    U8,      ///< a whole number from 0 to 255
    U16,     ///< a whole number from 0 to 65535
  };
  std::string name;  ///< of the standard, such as "cartesianX"
  Type type = Type::Double;
  std::size_t size() const { return type == Type::Double ? 8 : type == Type::U16 ? 2 : 1; }
};

/// What an E57 file says of its scan.
struct E57Scan {
  std::string name, software;
  std::string crs;                ///< WKT; empty: unknown
  double begin_s = 0, end_s = 0;  ///< GPS time of the first and the last point; 0: unknown
  std::array<double, 3> minimum{}, maximum{};
  bool has_colour = false, has_intensity = false;
};

/// Writes a file of one scan in the format E57 (ASTM E2807-11): pages of 1020 bytes with their CRC-32C, a section of
/// packets in which each field has its own stream of bytes, and a description in XML. The same points give the same
/// bytes. A file that was not closed has no description, so no reader takes it for whole.
/// Thread safety: none.
class E57File {
 public:
  /// Creates the file. Errors: Io.
  static Result<E57File> create(const std::filesystem::path& path, std::vector<E57Field> fields);
  /// Appends a point: the bytes of its fields in their order, little endian, without gaps. Errors: Io.
  Status add(storage::ByteView point);
  /// Writes the description and closes the file. Errors: Io.
  Status close(const E57Scan& scan);
  std::uint64_t points() const { return points_; }
  std::uint64_t size() const { return file_.size(); }

 private:
  E57File(storage::FileWriter file, std::vector<E57Field> fields);
  Status append(storage::ByteView bytes);
  Status write_packet();
  Status write_page();
  std::string description(const E57Scan& scan) const;

  storage::FileWriter file_;
  std::vector<E57Field> fields_;
  std::vector<storage::Bytes> streams_;  // of the points that wait for a packet, one for each field
  std::size_t waiting_ = 0, most_in_packet_ = 0;
  storage::Bytes page_, first_page_;  // the first one is written again at the end
  std::uint64_t written_ = 0;         // bytes without the pages' checksums
  std::uint64_t points_ = 0;
  std::array<std::uint64_t, 2> digest_;  // of all points: the identity of the file
};

}  // namespace hueline::products
