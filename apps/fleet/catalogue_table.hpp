#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "apps/fleet/catalogue.hpp"

/// The tables of the catalogue, written down once for all that it is written as: a GeoPackage or a database.
namespace hueline::apps {

/// What a column holds. Time is ISO 8601 in UTC.
enum class ColumnType : std::uint8_t { Text, Integer, Real, Time };

struct TableColumn {
  const char* name;
  ColumnType type;
};
/// A value of a row; std::monostate is NULL. A Time is a text.
using TableValue = std::variant<std::monostate, std::int64_t, double, std::string>;

/// A table: its rows have a key `fid`, a line if it is a table of lines, and these columns.
struct Table {
  const char* name;
  const char* about;
  std::vector<TableColumn> columns;
};

/// The drives, a table of lines: CatalogueEntry::places.
const Table& drives_table();
/// The files of the drives' results. Its first column, `drive_fid`, is the key of the drive.
const Table& products_table();

/// Returns the values of a drive, in the order of the columns of drives_table(). Its texts can be shown anywhere
/// (core/printable.hpp).
std::vector<TableValue> drive_row(const CatalogueEntry& entry);
/// Returns the values of a file of the results of the drive with that key, in the order of the columns of
/// products_table().
std::vector<TableValue> product_row(std::int64_t drive, const std::string& file, const FleetProduct& product);

}  // namespace hueline::apps
