#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/fleet/catalogue.hpp"
#include "core/result.hpp"

namespace hueline::apps {

/// Where a catalogue is written to.
class CatalogueOutput {
 public:
  /// Returns the database whose address this is, the page whose name ends with .html, or the GeoPackage of that name.
  /// Errors: Invalid if it is an address to which no catalogue can be written. The message does not repeat the address,
  /// which may hold a password.
  static Result<std::unique_ptr<CatalogueOutput>> of(const std::string& out);

  CatalogueOutput() = default;
  CatalogueOutput(const CatalogueOutput&) = delete;
  CatalogueOutput& operator=(const CatalogueOutput&) = delete;
  virtual ~CatalogueOutput() = default;

  /// Checks what write() would answer, without changing anything: a command asks before it reads recordings for hours.
  virtual Status check() const = 0;
  /// Writes the drives. Returns for people where they are: "in fleet.gpkg". Errors say what was not written and why.
  virtual Result<std::string> write(const std::vector<CatalogueEntry>& entries) const = 0;
};

}  // namespace hueline::apps
