#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

/// Reads what an E57 file (ASTM E2807-11) says of its scans, in XML.
namespace hueline::storage {

/// The coordinates of a whole file, m, in which each of its scans has a pose.
struct E57World {};

/// A field of the points of a scan, as the file describes it.
struct E57Column {
  enum class Kind : std::uint8_t { Float32, Float64, Integer };
  std::string name;  ///< of the standard, such as "cartesianX", or of an extension, such as "nor:normalX"
  Kind kind = Kind::Float64;
  unsigned bits = 64;                     ///< of a value; with 0 bits all values are the least
  std::int64_t minimum = 0, maximum = 0;  ///< of an integer, before it is scaled
  double scale = 1, offset = 0;           ///< value = integer * scale + offset
};

/// One scan of a file: points that were taken from one place, or that a program has put together.
struct E57Scan {
  std::string name;
  std::string sensor;        ///< maker, model and serial number, as far as they are known
  std::uint64_t points = 0;  ///< as the file counts them, with those that have no place
  std::vector<E57Column> columns;
  Transform<E57World, Scanner> T_world_scanner;
  std::optional<GpsTime> begin;  ///< of the acquisition

  /// Returns the index of a column, or nothing.
  std::optional<std::size_t> column(std::string_view wanted) const;

  std::uint64_t section = 0;  ///< where its points begin, in the file
};

/// What a file says of itself.
struct E57Description {
  std::vector<E57Scan> scans;
  std::size_t images = 0;
  std::string crs;  ///< as the file says it (WKT as a rule); empty if it says none
};

/// Reads the description of a file, which is XML in UTF-8; its bytes are changed. The declaration of a document type is
/// passed over, and what only it defines is not replaced. `name` stands for the file in messages. Errors: Malformed,
/// with the byte of the XML or with the scan; Unsupported (fields that are no numbers, more than kMostPcdColumns of
/// them, elements that are nested more than 64 deep).
Result<E57Description> decode_e57_description(std::string& xml, const std::string& name);

}  // namespace hueline::storage
