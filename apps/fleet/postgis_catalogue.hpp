#pragma once

#include <cstddef>
#include <vector>

#include "apps/fleet/catalogue.hpp"
#include "apps/fleet/postgres.hpp"
#include "core/result.hpp"

/// The catalogue in a database that several people and plans share: the tables of the GeoPackage in PostgreSQL with
/// PostGIS, in the first schema of the search path (docs/fleet.md).
///
/// A drive is known by CatalogueEntry::key. Writing it again replaces its row and those of its products, which keep
/// their `fid`; the rows of other drives stay as they are. Columns that others have added to the tables stay, too.
namespace hueline::apps {

/// How many drives were new in the database, and how many were replaced.
struct CatalogueChange {
  std::size_t added = 0, replaced = 0;
};

/// Does everything that precedes the rows, and undoes it: a command asks before it reads recordings for hours. Errors:
/// those of Postgres; Invalid if the tables are of another layout; Unavailable if the database has no PostGIS or no
/// schema for the tables.
Status check_postgis(const PostgresAddress& address);

/// Writes the drives in one transaction, one writer at a time, and makes the tables if they are missing. Errors: those
/// of check_postgis(); nothing is changed then, unless the connection is lost at the very end, which the message tells.
Result<CatalogueChange> write_postgis(const PostgresAddress& address, const std::vector<CatalogueEntry>& entries);

}  // namespace hueline::apps
