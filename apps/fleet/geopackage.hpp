#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/fleet/catalogue_table.hpp"
#include "core/geodesy.hpp"
#include "core/result.hpp"

struct sqlite3;

namespace hueline::apps {

/// Writes a GeoPackage (OGC 12-128r17, version 1.3): tables with and without lines on the ellipsoid WGS 84, in one file
/// that QGIS, GDAL and SQLite open. It is made in memory: the same rows give the same bytes. Names of tables and
/// columns are the caller's own, never a user's. After an error the further calls do nothing, and bytes() returns it.
/// Thread safety: none.
class GeoPackage {
 public:
  GeoPackage();
  ~GeoPackage();
  GeoPackage(const GeoPackage&) = delete;
  GeoPackage& operator=(const GeoPackage&) = delete;

  /// Adds a table of lines with the column `fid` (its key), `line` and those of the table.
  void add_lines(const Table& table);
  /// Adds a table without geometry, with the column `fid` and those of the table.
  void add_table(const Table& table);

  /// Adds a row to a table of lines and returns its key. A line with no place is NULL; one with a single place has it
  /// twice. Latitude and longitude in radians; the height is not written.
  std::int64_t add_line(const std::string& table, const std::vector<Geodetic>& line,
                        const std::vector<TableValue>& values);
  /// Adds a row to a table without geometry.
  void add_row(const std::string& table, const std::vector<TableValue>& values);

  /// Returns the file. `last_change` (ISO 8601, UTC) is written as the time of the last change of every table. Errors:
  /// Io with SQLite's reason.
  Result<std::string> bytes(const std::string& last_change);

 private:
  /// What the file says about a table.
  struct Content {
    std::string table, about;
    bool has_lines;
    double west = 180, south = 90, east = -180, north = -90;  // degrees
  };
  void create(const Table& table, bool has_lines);
  void execute(const std::string& sql);
  void insert(const std::string& table, const std::string& blob, const std::vector<TableValue>& values, bool has_blob);

  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::unique_ptr<sqlite3, Close> database_;
  std::vector<Content> contents_;
  Status status_;
};

}  // namespace hueline::apps
