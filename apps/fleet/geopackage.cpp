#include "apps/fleet/geopackage.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>

#include "apps/fleet/line.hpp"

namespace hueline::apps {
namespace {

struct EndStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// The tables that every GeoPackage has, and the reference systems that it must define: requirements 10 to 13 and 21 of
/// the standard.
constexpr const char* kFrame = R"(
PRAGMA application_id = 0x47504B47;
PRAGMA user_version = 10300;
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined Cartesian', -1, 'NONE', -1, 'undefined', NULL),
  ('Undefined geographic', 0, 'NONE', 0, 'undefined', NULL),
  ('WGS 84', 4326, 'EPSG', 4326, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]', 'longitude and latitude in degrees');
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
  description TEXT DEFAULT '', last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL, geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name), CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id));
)";

/// Returns the standard's name of a type, requirement 5.
const char* type_word(ColumnType type) {
  switch (type) {
    case ColumnType::Text:
      return "TEXT";
    case ColumnType::Integer:
      return "INTEGER";
    case ColumnType::Real:
      return "DOUBLE";
    case ColumnType::Time:
      return "DATETIME";
  }
  return "TEXT";
}

std::string text_literal(const std::string& text) {
  std::string out = "'";
  for (const char sign : text) out += sign == '\'' ? "''" : std::string(1, sign);
  return out + "'";
}

}  // namespace

void GeoPackage::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

GeoPackage::GeoPackage() {
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open_v2(":memory:", &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(raw);
  if (opened != SQLITE_OK)
    status_ = Error{ErrorCode::Io, "no memory for a database"};
  else
    execute(kFrame);
}

GeoPackage::~GeoPackage() = default;

void GeoPackage::execute(const std::string& sql) {
  if (!status_.ok()) return;
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    status_ = Error{ErrorCode::Io, fmt::format("the catalogue cannot be made: {}", sqlite3_errmsg(database_.get()))};
}

void GeoPackage::create(const Table& table, bool has_lines) {
  std::string sql = fmt::format("CREATE TABLE {} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL", table.name);
  if (has_lines) sql += ", line LINESTRING";
  for (const TableColumn& column : table.columns) sql += fmt::format(", {} {}", column.name, type_word(column.type));
  execute(sql + ")");
  contents_.push_back({table.name, table.about, has_lines});
}

void GeoPackage::add_lines(const Table& table) { create(table, true); }

void GeoPackage::add_table(const Table& table) { create(table, false); }

void GeoPackage::insert(const std::string& table, const std::string& blob, const std::vector<TableValue>& values,
                        bool has_blob) {
  if (!status_.ok()) return;
  std::string sql = fmt::format("INSERT INTO {} VALUES (NULL", table);
  for (std::size_t i = 0; i < values.size() + (has_blob ? 1 : 0); ++i) sql += ", ?";
  sqlite3_stmt* raw = nullptr;
  int done = sqlite3_prepare_v2(database_.get(), (sql + ")").c_str(), -1, &raw, nullptr);
  const std::unique_ptr<sqlite3_stmt, EndStatement> statement(raw);
  int place = 1;
  if (done == SQLITE_OK && has_blob) {
    if (!blob.empty()) done = sqlite3_bind_blob64(raw, place, blob.data(), blob.size(), SQLITE_TRANSIENT);
    ++place;
  }
  for (const TableValue& value : values) {
    if (done != SQLITE_OK) break;
    if (const auto* number = std::get_if<std::int64_t>(&value))
      done = sqlite3_bind_int64(raw, place, *number);
    else if (const auto* real = std::get_if<double>(&value))
      done = sqlite3_bind_double(raw, place, *real);
    else if (const auto* text = std::get_if<std::string>(&value))
      done = sqlite3_bind_text64(raw, place, text->data(), text->size(), SQLITE_TRANSIENT, SQLITE_UTF8);
    ++place;
  }
  if (done == SQLITE_OK) done = sqlite3_step(raw);
  if (done != SQLITE_DONE)
    status_ = Error{ErrorCode::Io, fmt::format("the catalogue cannot be made: {}", sqlite3_errmsg(database_.get()))};
}

std::int64_t GeoPackage::add_line(const std::string& table, const std::vector<Geodetic>& line,
                                  const std::vector<TableValue>& values) {
  std::string blob;
  if (const std::vector<LinePlace> places = line_of(line); !places.empty()) {
    const auto [west, east] = std::ranges::minmax(places, {}, &LinePlace::first);
    const auto [south, north] = std::ranges::minmax(places, {}, &LinePlace::second);
    // The standard's header, 2.1.3: magic, version 0, flags (little endian, an envelope of four numbers), the reference
    // system, the envelope.
    blob = "GP";
    blob += '\0';
    blob += '\3';
    put_number(blob, std::int32_t{4326});
    for (const double bound : {west.first, east.first, south.second, north.second}) put_number(blob, bound);
    blob += well_known_binary(places);
    const auto known = std::ranges::find(contents_, table, &Content::table);
    if (known != contents_.end()) {
      known->west = std::min(known->west, west.first);
      known->east = std::max(known->east, east.first);
      known->south = std::min(known->south, south.second);
      known->north = std::max(known->north, north.second);
    }
  }
  insert(table, blob, values, true);
  return status_.ok() ? sqlite3_last_insert_rowid(database_.get()) : 0;
}

void GeoPackage::add_row(const std::string& table, const std::vector<TableValue>& values) {
  insert(table, {}, values, false);
}

Result<std::string> GeoPackage::bytes(const std::string& last_change) {
  for (const Content& table : contents_) {
    const bool has_bounds = table.has_lines && table.west <= table.east;
    execute(fmt::format("INSERT INTO gpkg_contents VALUES ('{}', '{}', '{}', {}, {}, {}, {})", table.table,
                        table.has_lines ? "features" : "attributes", table.table, text_literal(table.about),
                        text_literal(last_change),
                        has_bounds ? fmt::format("{}, {}, {}, {}", table.west, table.south, table.east, table.north)
                                   : "NULL, NULL, NULL, NULL",
                        table.has_lines ? "4326" : "NULL"));
    if (table.has_lines)
      execute(fmt::format("INSERT INTO gpkg_geometry_columns VALUES ('{}', 'line', 'LINESTRING', 4326, 0, 0)",
                          table.table));
  }
  if (!status_.ok()) return status_.error();
  sqlite3_int64 size = 0;
  unsigned char* raw = sqlite3_serialize(database_.get(), "main", &size, 0);
  if (raw == nullptr) return Error{ErrorCode::Io, "no memory for the catalogue"};
  std::string out(reinterpret_cast<const char*>(raw), static_cast<std::size_t>(size));
  sqlite3_free(raw);
  return out;
}

}  // namespace hueline::apps
